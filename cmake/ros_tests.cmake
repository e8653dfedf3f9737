# Tests of the ROS side; filled below as they are written.
