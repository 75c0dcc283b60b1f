pragma Singleton
import Ros2.Native 1.0

Ros2ClockTypesNative {}
