// Colours and squares of points. colour: pixels up to which squares are drawn as points of the graphics
// interface, 0 for none, and the opacity as alpha; a: mode, low, high, and whether the rainbow is
// inverted or, in mode bgra, points have an opacity each; b: first colour and size; c: last colour and
// unit of the size: 0 pixels, 1 metres, 2 metres at a depth of 1 m; d: axis.
vec3 rainbow(float part)
{
    // RViz's: from magenta (0) over blue, cyan, green and yellow to red (1).
    float h = 5.0 * part;
    return clamp(vec3(max(1.0 - h, h - 3.0), min(h - 1.0, 5.0 - h), 3.0 - h), 0.0, 1.0);
}

vec4 straight_colour(vec3 position, vec4 channel)
{
    float mode = object.a.x;
    if (mode < 0.5) return vec4(object.b.rgb, object.colour.a);
    if (mode < 1.5) return vec4(channel.bgr, object.colour.a * (object.a.w > 0.5 ? channel.a : 1.0));
    float value = mode < 3.5 ? channel.x : dot(object.d, vec4(position, 1.0));
    float span = object.a.z - object.a.y;
    float part = span != 0.0 ? (value - object.a.y) / span : 0.0;
    if (!(abs(part) < 1e30)) part = 0.0;
    part = clamp(part, 0.0, 1.0);
    if (mode > 2.5 && mode < 3.5) return vec4(mix(object.b.rgb, object.c.rgb, part), object.colour.a);
    return vec4(rainbow(object.a.w > 0.5 ? part : 1.0 - part), object.colour.a);
}

// Premultiplied.
vec4 point_colour(vec3 position, vec4 channel)
{
    vec4 colour = straight_colour(position, channel);
    return vec4(colour.rgb * colour.a, colour.a);
}

float size_in_metres(vec3 position)
{
    return object.c.w > 1.5 && object.c.w < 2.5 ? object.b.w * position.z : object.b.w;
}

bool is_finite(vec3 v)
{
    return abs(v.x) < 1e30 && abs(v.y) < 1e30 && abs(v.z) < 1e30;
}

// Whether a square of some metres is drawn as a point of the graphics interface.
bool is_small(vec4 clip, float size)
{
    return size * abs(frame.projection[1][1]) * frame.viewport.y * 0.5 <= object.colour.r * clip.w;
}

// Half sides of a square that faces the eye, one of them across to the y axis of its frame, as in RViz.
void square_sides(vec3 eye, float size, out vec3 across, out vec3 up)
{
    vec3 at = frame.viewport.w > 0.5 ? vec3(0.0, 0.0, 1.0) : normalize(-eye);
    across = cross((frame.view * object.model[1]).xyz, at);
    across = (dot(across, across) > 1e-12 ? normalize(across) : vec3(1.0, 0.0, 0.0)) * (0.5 * size);
    up = cross(at, across);
}

// Outside of every view.
const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);
