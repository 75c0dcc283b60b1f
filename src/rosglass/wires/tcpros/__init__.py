"""TCPROS and XML-RPC: the registration of ROS 1's endpoints, and the transport of their data."""
