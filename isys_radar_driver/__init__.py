"""ROS 2 driver of the InnoSenT iSYS radars."""
