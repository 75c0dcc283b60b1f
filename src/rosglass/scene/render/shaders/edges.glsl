// The edge of squares, as in RViz: darker, or lighter if the square is dark.
// at: the place on the square, each way from -1 to 1.
vec4 with_edge(vec4 colour, vec2 at)
{
    float edge = smoothstep(0.9, 0.96, max(abs(at.x), abs(at.y)));
    float shift = sign(0.5 * colour.a - length(colour.rgb)) * 0.2 * colour.a;
    return vec4(clamp(colour.rgb + edge * shift, vec3(0.0), vec3(colour.a)), colour.a);
}
