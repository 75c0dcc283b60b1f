// Colours of points. a: mode, low, high, inverted; b: first colour and size; c: last colour and
// style; d: axis.
vec3 rainbow(float value)
{
    // RViz's: from red (1) over yellow, green, cyan and blue to magenta (0).
    value = clamp(value, 0.0, 1.0);
    float h = value * 5.0 + 1.0;
    float i = floor(h);
    float f = h - i;
    if (mod(i, 2.0) < 0.5) f = 1.0 - f;
    float n = 1.0 - f;
    if (i <= 1.0) return vec3(n, 0.0, 1.0);
    if (i <= 2.0) return vec3(0.0, n, 1.0);
    if (i <= 3.0) return vec3(0.0, 1.0, n);
    if (i <= 4.0) return vec3(n, 1.0, 0.0);
    return vec3(1.0, n, 0.0);
}

vec4 point_colour(vec3 position, vec4 channel)
{
    float mode = object.a.x;
    if (mode < 0.5) return vec4(object.b.rgb, object.colour.a);
    if (mode < 1.5) return vec4(channel.bgr, object.colour.a);
    float value = mode < 3.5 ? channel.x : dot(object.d, vec4(position, 1.0));
    float span = object.a.z - object.a.y;
    float part = span != 0.0 ? (value - object.a.y) / span : 0.0;
    if (!(abs(part) < 1e30)) part = 0.0;
    part = clamp(part, 0.0, 1.0);
    if (mode > 2.5 && mode < 3.5) return vec4(mix(object.b.rgb, object.c.rgb, part), object.colour.a);
    return vec4(rainbow(object.a.w > 0.5 ? part : 1.0 - part), object.colour.a);
}

bool is_finite(vec3 v)
{
    return abs(v.x) < 1e30 && abs(v.y) < 1e30 && abs(v.z) < 1e30;
}

// Outside of every view.
const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);
