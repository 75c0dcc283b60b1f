// What all shaders share; scripts/shaders.py puts it in front of each.
layout(std140, binding = 0) uniform Frame {
    mat4 view;        // from the renderer's origin to the eye: x right, y up, looking along -z
    mat4 projection;  // corrected for the graphics interface
    vec4 viewport;    // width and height in pixels, pixels per unit of the screen, 1 if orthographic
} frame;
layout(std140, binding = 1) uniform Object {
    mat4 model;       // from the drawable to the renderer's origin
    vec4 colour;
    vec4 a;
    vec4 b;
    vec4 c;
    vec4 d;
} object;
