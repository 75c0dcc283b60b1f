layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 uv;
layout(location = 3) in vec4 rgba;
layout(location = 4) in vec4 column0;
layout(location = 5) in vec4 column1;
layout(location = 6) in vec4 column2;
layout(location = 7) in vec4 column3;
layout(location = 8) in vec4 tint;
layout(location = 0) out vec4 v_colour;
layout(location = 1) out vec3 v_normal;
layout(location = 2) out vec2 v_uv;
layout(location = 3) out vec3 v_eye;

void main()
{
    mat4 instance = mat4(column0, column1, column2, column3);
    // A closed shape is symmetric: mirrored twice, its outer side remains the one that is drawn.
    if (object.a.y > 0.5 && determinant(mat3(object.model) * mat3(instance)) < 0.0)
        instance[0] = -instance[0];
    mat4 place = frame.view * object.model;
    vec4 eye = place * (instance * vec4(position, 1.0));
    // The normal of a scaled surface: by the inverse transposed, up to its length.
    mat3 m = mat3(instance);
    mat3 cofactor = mat3(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    v_normal = mat3(place) * (cofactor * normal);
    v_colour = rgba * tint * object.colour;
    v_uv = uv;
    v_eye = eye.xyz;
    gl_Position = frame.projection * eye;
}
