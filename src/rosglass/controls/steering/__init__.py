"""Commands to the robot, and their inputs."""
