"""ROS 2 over DDS: `rmw_cyclonedds`, `rmw_fastrtps` and the like, through Cyclone DDS."""
