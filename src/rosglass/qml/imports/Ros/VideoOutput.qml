import Rosglass.Video 1.0 as Video

Video.VideoOutput {}
