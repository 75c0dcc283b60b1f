// Points of some pixels, where the graphics interface has them.
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 channel;
layout(location = 0) flat out vec4 v_colour;

void main()
{
    v_colour = point_colour(position, channel);
    gl_PointSize = object.b.w * frame.viewport.z;
    gl_Position = is_finite(position)
        ? frame.projection * (frame.view * (object.model * vec4(position, 1.0))) : NOWHERE;
}
