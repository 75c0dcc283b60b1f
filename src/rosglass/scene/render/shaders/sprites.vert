// Squares that face the viewer as points of some pixels, each as large as the square's bounds: one
// vertex instead of four.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 channel;
layout(location = 0) flat out vec4 v_colour;
layout(location = 1) flat out vec4 v_sides;

void main()
{
    v_colour = point_colour(position, channel);
    v_sides = vec4(0.0);
    gl_PointSize = 1.0;
    vec4 eye = frame.view * (object.model * vec4(position, 1.0));
    vec4 at = frame.projection * eye;
    float size = size_in_metres(position);
    if (!is_finite(position) || !is_small(at, size)) {
        gl_Position = NOWHERE;
        return;
    }
    gl_Position = at;
    // Both half sides in pixels.
    vec3 across, up;
    square_sides(eye.xyz, size, across, up);
    vec4 move = frame.projection * vec4(across, 0.0);
    vec2 a = (move.xy - at.xy * (move.w / at.w)) * (0.5 / at.w) * frame.viewport.xy;
    move = frame.projection * vec4(up, 0.0);
    vec2 b = (move.xy - at.xy * (move.w / at.w)) * (0.5 / at.w) * frame.viewport.xy;
    vec2 bounds = abs(a) + abs(b);
    float half_px = max(max(bounds.x, bounds.y), 0.5);
    gl_PointSize = 2.0 * half_px;
    // From a place on the point, each way from -1 to 1, to one on the square.
    v_sides = vec4(b.y, -b.x, -a.y, a.x) * (half_px / (a.x * b.y - a.y * b.x));
}
