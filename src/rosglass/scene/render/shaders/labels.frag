layout(location = 0) in vec4 v_colour;
layout(location = 1) in vec2 v_uv;
layout(location = 0) out vec4 colour;
layout(binding = 2) uniform sampler2D image;

void main()
{
    float cover = texture(image, v_uv).r * v_colour.a;
    if (cover < 0.004) discard;
    colour = vec4(v_colour.rgb * cover, cover);
}
