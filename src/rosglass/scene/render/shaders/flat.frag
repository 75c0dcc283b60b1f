layout(location = 0) in vec4 v_colour;
layout(location = 0) out vec4 colour;

void main()
{
    colour = vec4(v_colour.rgb * v_colour.a, v_colour.a);
}
