import QtMultimedia 5.15 as Multimedia

// Has `source` already. Here so that an interface for both Qt versions need not import QtMultimedia.
Multimedia.VideoOutput {}
