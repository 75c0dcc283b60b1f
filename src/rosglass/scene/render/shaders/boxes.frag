// A side of a box with darker edges, which separate it from the next one.
layout(location = 0) flat in vec4 v_colour;
layout(location = 1) in vec2 v_corner;
layout(location = 0) out vec4 colour;

void main()
{
    float edge = smoothstep(0.9, 0.96, max(abs(v_corner.x), abs(v_corner.y)));
    colour = vec4(v_colour.rgb * (1.0 - 0.5 * edge), v_colour.a);
}
