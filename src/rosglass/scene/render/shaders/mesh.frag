// a: whether it is lit. The light comes from the eye, as in RViz.
layout(location = 0) in vec4 v_colour;
layout(location = 1) in vec3 v_normal;
layout(location = 2) in vec2 v_uv;
layout(location = 3) in vec3 v_eye;
layout(location = 0) out vec4 colour;
layout(binding = 2) uniform sampler2D image;

void main()
{
    vec4 tint = v_colour * texture(image, v_uv);
    if (object.a.x > 0.5) {
        float far = length(v_normal);
        // Both sides of a surface are lit: meshes of robots are not always closed.
        tint.rgb *= far > 0.0 ? abs(v_normal.z) / far : 1.0;
    }
    colour = vec4(tint.rgb * tint.a, tint.a);
}
