"""The figures that the papers print, as they print them: the one place that holds them.

A table is {row: {column: value}}; a value is a frame rate unless the table's name says otherwise. Charts whose values
are only drawn are not here, but for what the text says of them (CHART_CLAIMS).
"""

from __future__ import annotations

Table = dict[str, dict[str, float]]

SOURCES = {
    "2007a": "Hübner and Pajarola 2007, Single-pass multi-view volume rendering; ATI Radeon X1900",
    "2007b": "Hübner, Zhang, Pajarola 2007, Single-pass multi-view rendering; ATI Radeon X1900",
    "2008": "de Sorbier, Nozick, Biri 2008, GPU rendering for autostereoscopic displays; GeForce 8800 GTS",
    "2020": "PMR 2020, Parallel multi-view polygon rasterization for 3D light field display; GeForce RTX 2080",
}

SV, MV, GPU_MV = "SV", "MV", "GPU-MV"
SUBRES_512, SUBRES_1900 = "MV sub-res 256×256", "MV sub-res 512×512"  # by the size of a panel: of its small views
BUCKY, NEGHIP, HYDROGEN, ENGINE, SKULL = (
    "Buckyball 32³", "Neghip 64³", "Hydrogen 128³", "Engine 256³", "Skull 256³"
)  # fmt: skip

BUNNY, DRAGON = "Bunny 69k", "Dragon 100k"  # meshes that 2007b's charts may have had: its data are Stanford's

VOLUMES_512: Table = {  # 2007a, Table 1: 512×512, 8 views
    BUCKY: {SV: 463, MV: 51, GPU_MV: 128},
    NEGHIP: {SV: 241, MV: 29, GPU_MV: 57},
    HYDROGEN: {SV: 89, MV: 10, GPU_MV: 26},
    ENGINE: {SV: 15, MV: 1.9, GPU_MV: 8.3},
    SKULL: {SV: 15, MV: 1.8, GPU_MV: 7.8},
}
VOLUMES_1900: Table = {  # 2007a, Table 2: 1900×1200, 8 views
    BUCKY: {SV: 116, MV: 12.8, SUBRES_1900: 39, GPU_MV: 26.6},
    NEGHIP: {SV: 58.8, MV: 6.8, SUBRES_1900: 25.6, GPU_MV: 11.9},
    HYDROGEN: {SV: 24.8, MV: 3.3, SUBRES_1900: 10.5, GPU_MV: 5.5},
    ENGINE: {SV: 6.4, MV: 0.9, SUBRES_1900: 1.9, GPU_MV: 2.1},
    SKULL: {SV: 5.9, MV: 0.8, SUBRES_1900: 1.8, GPU_MV: 2},
}
FIGURE_6: Table = {ENGINE: {GPU_MV: 8.3, MV: 1.9, SUBRES_512: 3}}  # 2007a, 512×512

CHART_CLAIMS: Table = {  # per cent of the single view, as the text of 2007a and 2007b has them
    "8 views": {MV: 100 / 8, GPU_MV: 100 / 3},
    "stereo": {MV: 100 / 2},
}

N_PASS, GEOMETRY = "n-pass", "geometry-shader"
VIEWS_2008: Table = {  # 2008, Table 1: about 80,000 triangles
    "1 view": {N_PASS: 157, GEOMETRY: 157},
    "2 views": {N_PASS: 80, GEOMETRY: 141},
    "4 views": {N_PASS: 38, GEOMETRY: 70},
    "8 views": {N_PASS: 19, GEOMETRY: 24},
}
ILLUMINATION_2008: Table = {  # 2008, Table 2
    "2 views": {"none": 326, "texture": 326, "per vertex": 160, "per pixel": 160},
    "4 views": {"none": 168, "texture": 167, "per vertex": 83, "per pixel": 83},
    "6 views": {"none": 80, "texture": 80, "per vertex": 28, "per pixel": 28},
    "8 views": {"none": 60, "texture": 60, "per vertex": 24, "per pixel": 23},
}
PASSES_2008: Table = {  # 2008, Table 3: 12 views in so many passes; one pass: N/A
    "12 views": {"2 passes": 14, "3 passes": 15, "4 passes": 23, "6 passes": 21, N_PASS: 14}
}
VARYINGS_2008 = (13, 14, 2.0, 4)  # section 5: from 13 to 14 numbers doubles the time, in the 4-view case
HEADLINE_2020 = 60.0  # fps, "more than", panel 7680×4320, 96 views of 1024×512, 1 M vertices
FASTER_FROM_2020 = 10  # views from which Fig. 15 has the one pass ahead
MULTIPLICATIONS_2020 = (38.0, 8.0, 30.0)  # section 3: 38·m·n view by view, 8·m·n + 30·m in one pass
