// Points as boxes of some metres, along the axes of the fixed frame of the drawable.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 channel;
layout(location = 0) out vec4 v_colour;

void main()
{
    int face = gl_VertexIndex / 6;
    int corner = gl_VertexIndex - face * 6;
    // Two triangles: corners 0 1 2, 2 1 3 of the face.
    int at = corner < 3 ? corner : (corner == 3 ? 2 : (corner == 4 ? 1 : 3));
    float u = float(at & 1) - 0.5;
    float v = float(at >> 1) - 0.5;
    float w = (face & 1) == 0 ? -0.5 : 0.5;
    int axis = face >> 1;
    vec3 offset = axis == 0 ? vec3(w, u, v) : (axis == 1 ? vec3(v, w, u) : vec3(u, v, w));
    vec3 normal = axis == 0 ? vec3(w, 0, 0) : (axis == 1 ? vec3(0, w, 0) : vec3(0, 0, w));
    vec3 eye_normal = normalize(mat3(frame.view) * (mat3(object.model) * normal));
    vec4 tint = point_colour(position, channel);
    v_colour = vec4(tint.rgb * (0.25 + 0.75 * abs(eye_normal.z)), tint.a);
    gl_Position = is_finite(position)
        ? frame.projection * (frame.view * (object.model * vec4(position + offset * size_in_metres(position), 1.0)))
        : NOWHERE;
}
