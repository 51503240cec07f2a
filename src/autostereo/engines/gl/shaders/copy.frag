// A picture into a tile.
uniform sampler2D picture;
uniform ivec2 first_pixel;  // of the tile
out vec4 color;
void main() {
    color = texelFetch(picture, ivec2(gl_FragCoord.xy) - first_pixel, 0);
}
