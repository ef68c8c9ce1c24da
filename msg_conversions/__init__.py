"""Plain values in, ROS messages out; knows no device."""
