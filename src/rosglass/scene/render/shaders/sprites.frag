// The part of a point that a square covers. colour.g: whether it has an edge.
layout(location = 0) flat in vec4 v_colour;
layout(location = 1) flat in vec4 v_sides;
layout(location = 0) out vec4 colour;

void main()
{
    vec2 at = gl_PointCoord * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    vec2 on_square = abs(vec2(dot(v_sides.xy, at), dot(v_sides.zw, at)));
    if (max(on_square.x, on_square.y) > 1.0) discard;
    colour = object.colour.g > 0.5 ? with_edge(v_colour, on_square) : v_colour;
}
