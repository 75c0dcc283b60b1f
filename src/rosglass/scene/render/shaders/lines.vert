// Lines as rectangles of some pixels, or as bands of some metres that face the eye and bend to
// their neighbours. a: width, whether that is metres.
layout(location = 0) in vec3 start;
layout(location = 1) in vec3 end;
layout(location = 2) in vec4 first;
layout(location = 3) in vec4 last;
layout(location = 4) in vec3 before;
layout(location = 5) in vec3 after;
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
    bool is_end = (gl_VertexIndex & 1) == 1;
    float sign = (gl_VertexIndex & 2) == 0 ? -1.0 : 1.0;
    vec4 tint = is_end ? last : first;
    v_colour = tint * object.colour;
    if (object.a.y > 0.5) {
        vec4 at = is_end ? q : p;
        vec3 along = mat3(frame.view * object.model) * (is_end ? after - start : end - before);
        vec3 side = cross(along, frame.viewport.w < 0.5 ? -at.xyz : vec3(0.0, 0.0, 1.0));
        float far = length(side);
        // At least a pixel: half the height of the view is 1 / projection[1][1].
        float w = (frame.projection * at).w;
        float pixel = w / (abs(frame.projection[1][1]) * frame.viewport.y);
        at.xyz += sign * max(object.a.x * 0.5, pixel) * (far > 0.0 ? side / far : vec3(0.0));
        gl_Position = frame.projection * at;
        return;
    }
    vec4 a = frame.projection * p;
    vec4 b = frame.projection * q;
    vec2 along = b.xy / b.w * frame.viewport.xy - a.xy / a.w * frame.viewport.xy;
    float far = length(along);
    along = far > 1e-6 ? along / far : vec2(1.0, 0.0);
    vec2 side = vec2(-along.y, along.x);
    vec4 at = is_end ? b : a;
    float pixels = object.a.x * frame.viewport.z;
    at.xy += sign * side * pixels / frame.viewport.xy * at.w;
    gl_Position = at;
}
