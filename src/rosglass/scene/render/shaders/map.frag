layout(location = 0) in vec2 v_uv;
layout(location = 0) out vec4 colour;
layout(binding = 2) uniform sampler2D cells;
layout(binding = 3) uniform sampler2D palette;

void main()
{
    float cell = floor(texture(cells, v_uv).r * 255.0 + 0.5);
    vec4 tint = texture(palette, vec2((cell + 0.5) / 256.0, 0.5));
    tint.a *= object.colour.a;
    if (tint.a <= 0.0) discard;
    colour = vec4(tint.rgb * tint.a, tint.a);
}
