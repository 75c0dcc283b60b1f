// Lines as rectangles of some pixels or metres. a: width, whether that is metres.
layout(location = 0) in vec3 start;
layout(location = 1) in vec3 end;
layout(location = 2) in vec4 first;
layout(location = 3) in vec4 last;
layout(location = 0) out vec4 v_colour;

void main()
{
    vec4 p = frame.view * (object.model * vec4(start, 1.0));
    vec4 q = frame.view * (object.model * vec4(end, 1.0));
    // What is behind the eye would be turned over: cut there.
    float near = -0.001;
    if (frame.viewport.w < 0.5) {
        if (p.z > near && q.z > near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); v_colour = first; return; }
        if (p.z > near) p = mix(q, p, (q.z - near) / (q.z - p.z));
        else if (q.z > near) q = mix(p, q, (p.z - near) / (p.z - q.z));
    }
    vec4 a = frame.projection * p;
    vec4 b = frame.projection * q;
    vec2 along = b.xy / b.w * frame.viewport.xy - a.xy / a.w * frame.viewport.xy;
    float far = length(along);
    along = far > 1e-6 ? along / far : vec2(1.0, 0.0);
    vec2 side = vec2(-along.y, along.x);
    bool is_end = (gl_VertexIndex & 1) == 1;
    float sign = (gl_VertexIndex & 2) == 0 ? -1.0 : 1.0;
    vec4 at = is_end ? b : a;
    float pixels = object.a.x * frame.viewport.z;
    if (object.a.y > 0.5)  // metres: half the height of the view is 1 / projection[1][1]
        pixels = max(object.a.x * abs(frame.projection[1][1]) / at.w * frame.viewport.y * 0.5, 1.0);
    at.xy += sign * side * pixels / frame.viewport.xy * at.w;
    vec4 tint = is_end ? last : first;
    v_colour = tint * object.colour;
    gl_Position = at;
}
