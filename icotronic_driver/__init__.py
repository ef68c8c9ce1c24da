"""ROS 2 driver of the ICOtronic wireless accelerometers."""
