"""ROS 2 driver of the Pepperl+Fuchs UC4000 ultrasonic sensors."""
