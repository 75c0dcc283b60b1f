// Points as boxes of some metres, along the axes of the fixed frame of the drawable.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 channel;
layout(location = 0) flat out vec4 v_colour;
layout(location = 1) out vec2 v_corner;

// RViz's light: of the sides towards -x, x, -y, y, -z and z.
const float LIGHT[6] = float[](0.6, 0.6, 1.0, 0.4, 0.5, 0.9);

void main()
{
    int face = gl_VertexIndex / 6;
    int corner = gl_VertexIndex - face * 6;
    // Two triangles: corners 0 1 2, 2 1 3 of the face.
    int at = corner < 3 ? corner : (corner == 3 ? 2 : (corner == 4 ? 1 : 3));
    float w = (face & 1) == 0 ? -0.5 : 0.5;
    // Counter-clockwise from outside: the inner sides are not drawn.
    float u = (float(at & 1) - 0.5) * w * 2.0;
    float v = float(at >> 1) - 0.5;
    int axis = face >> 1;
    vec3 offset = axis == 0 ? vec3(w, u, v) : (axis == 1 ? vec3(v, w, u) : vec3(u, v, w));
    vec4 tint = point_colour(position, channel);
    v_colour = vec4(tint.rgb * LIGHT[face], tint.a);
    v_corner = vec2(u, v) * 2.0;
    gl_Position = is_finite(position)
        ? frame.projection * (frame.view * (object.model * vec4(position + offset * size_in_metres(position), 1.0)))
        : NOWHERE;
}
