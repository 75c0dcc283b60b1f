// A square with an edge.
layout(location = 0) flat in vec4 v_colour;
layout(location = 1) in vec2 v_corner;
layout(location = 0) out vec4 colour;

void main()
{
    colour = with_edge(v_colour, v_corner);
}
