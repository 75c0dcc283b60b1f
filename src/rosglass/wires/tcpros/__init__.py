"""TCPROS and XML-RPC: what announces the endpoints of ROS 1 nodes, and moves their bytes."""
