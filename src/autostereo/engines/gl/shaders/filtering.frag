// The device's own interpolation at PLACES places between two voxels, one a pixel (filtering.py).
uniform sampler3D voxels;

out vec4 found;

void main() {
    float part = floor(gl_FragCoord.x) / float(PLACES);
    found = vec4(textureLod(voxels, vec3(0.25 + 0.5 * part, 0.5, 0.5), 0.0).r);
}
