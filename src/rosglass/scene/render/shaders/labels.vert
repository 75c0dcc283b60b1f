// Texts that face the viewer. a.x: whether sizes are pixels; a.y: 1 if left-aligned; a.z: 1 if below.
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 size;
layout(location = 2) in vec4 place;  // in the image: left, top, width, height
layout(location = 3) in vec4 rgba;
layout(location = 0) out vec4 v_colour;
layout(location = 1) out vec2 v_uv;

void main()
{
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    v_uv = place.xy + vec2(corner.x, 1.0 - corner.y) * place.zw;
    v_colour = rgba * object.colour;
    vec2 offset = (corner - vec2(object.a.y > 0.5 ? 0.0 : 0.5, object.a.z > 0.5 ? 1.0 : 0.5)) * size;
    vec4 eye = frame.view * (object.model * vec4(position, 1.0));
    if (object.a.x > 0.5) {
        gl_Position = frame.projection * eye;
        offset.y *= sign(frame.projection[1][1]);  // Vulkan's y points down
        gl_Position.xy += 2.0 * offset * frame.viewport.z * gl_Position.w / frame.viewport.xy;
    } else {
        eye.xy += offset;
        gl_Position = frame.projection * eye;
    }
}
