// A picture and its depths, to be read while they are drawn over.
uniform sampler2D picture, depths;
layout(location = 0) out vec4 color;
layout(location = 1) out vec4 depth;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    color = texelFetch(picture, at, 0);
    depth = texelFetch(depths, at, 0);
}
