// Points as rectangles that face the viewer: of some pixels, or of some metres.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 channel;
layout(location = 0) flat out vec4 v_colour;
layout(location = 1) out vec2 v_corner;

void main()
{
    v_colour = point_colour(position, channel);
    v_corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) * 2.0 - 1.0;
    vec4 eye = frame.view * (object.model * vec4(position, 1.0));
    if (object.c.w > 2.5) {  // in the plane of their own frame
        vec4 at = vec4(position + vec3(v_corner * object.b.w * 0.5, 0.0), 1.0);
        gl_Position = frame.projection * (frame.view * (object.model * at));
    } else if (object.c.w > 0.5) {  // metres
        float size = size_in_metres(position);
        bool drawn = object.colour.r == 0.0 || !is_small(frame.projection * eye, size);
        vec3 across, up;
        square_sides(eye.xyz, size, across, up);
        eye.xyz += v_corner.x * across + v_corner.y * up;
        gl_Position = drawn ? frame.projection * eye : NOWHERE;
    } else {
        gl_Position = frame.projection * eye;
        gl_Position.xy += v_corner * object.b.w * frame.viewport.z * gl_Position.w / frame.viewport.xy;
    }
    if (!is_finite(position)) gl_Position = NOWHERE;
}
