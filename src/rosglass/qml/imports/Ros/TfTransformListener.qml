pragma Singleton
import Ros.Native 1.0

TfTransformListenerNative {}
