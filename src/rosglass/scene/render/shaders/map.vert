// A rectangle in the plane z = 0. a: metres in x and y.
layout(location = 0) out vec2 v_uv;

void main()
{
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    v_uv = corner;
    gl_Position = frame.projection * (frame.view * (object.model * vec4(corner * object.a.xy, 0.0, 1.0)));
}
