// A rectangle shaded as a sphere, with RViz's light.
layout(location = 0) flat in vec4 v_colour;
layout(location = 1) in vec2 v_corner;
layout(location = 0) out vec4 colour;

void main()
{
    float far = dot(v_corner, v_corner);
    if (far > 1.0) discard;
    float light = 1.0 - 0.2 * far;
    colour = vec4(v_colour.rgb * light, v_colour.a);
}
