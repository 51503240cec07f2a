// A picture, and its depths with the switch DEPTHS, from first_pixel on: into a tile, or to be read while drawn over.
uniform sampler2D picture;
uniform ivec2 first_pixel;
layout(location = 0) out vec4 color;
#ifdef DEPTHS
uniform sampler2D depths;
layout(location = 1) out vec4 depth;
#endif
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - first_pixel;
    color = texelFetch(picture, at, 0);
#ifdef DEPTHS
    depth = texelFetch(depths, at, 0);
#endif
}
