// Points as boxes of some metres, along the axes of the fixed frame of the drawable.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 channel;
layout(location = 0) flat out vec4 v_colour;
layout(location = 1) out vec2 v_corner;

// RViz's light: of the sides towards -x, x, -y, y, -z and z.
const float LIGHT[6] = float[](0.6, 0.6, 1.0, 0.4, 0.5, 0.9);

void main()
{
    // Of the two sides across to each axis, only the one towards the eye can be seen.
    int axis = gl_VertexIndex / 6;
    int corner = gl_VertexIndex - axis * 6;
    // Two triangles: corners 0 1 2, 2 1 3 of the side.
    int at = corner < 3 ? corner : (corner == 3 ? 2 : (corner == 4 ? 1 : 3));
    vec4 middle = frame.view * (object.model * vec4(position, 1.0));
    vec3 along = (frame.view * object.model[axis]).xyz;
    float w = dot(along, frame.viewport.w > 0.5 ? vec3(0.0, 0.0, 1.0) : -middle.xyz) > 0.0 ? 0.5 : -0.5;
    // Counter-clockwise from outside: the inner sides are not drawn.
    float u = (float(at & 1) - 0.5) * w * 2.0;
    float v = float(at >> 1) - 0.5;
    vec3 offset = axis == 0 ? vec3(w, u, v) : (axis == 1 ? vec3(v, w, u) : vec3(u, v, w));
    vec4 tint = point_colour(position, channel);
    v_colour = vec4(tint.rgb * LIGHT[axis * 2 + (w > 0.0 ? 1 : 0)], tint.a);
    v_corner = vec2(u, v) * 2.0;
    gl_Position = is_finite(position)
        ? frame.projection * (middle + frame.view * (object.model * vec4(offset * size_in_metres(position), 0.0)))
        : NOWHERE;
}
