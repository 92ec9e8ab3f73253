"""A small deferred renderer on OpenGL: G-buffers, direct light with shadow maps, and a composite that adds what a pass
found. Rows of its textures run from the top, as the pass wants them: the projection that OpenGL gets has y negated."""

import moderngl
import numpy as np

GEOMETRY = """
#version 430
uniform mat4 clip_from_world, clip_before, world;
uniform vec3 eye, color, emission;
uniform float metallic, roughness;
#ifdef VERTEX
in vec3 position; in vec3 normal; in vec2 uv;
out vec3 p, n; out vec2 t; out vec4 now, before;
void main() {
    vec4 w = world * vec4(position, 1.0);
    p = w.xyz; t = uv;
    n = transpose(inverse(mat3(world))) * normal;
    gl_Position = now = clip_from_world * w;
    before = clip_before * w;
}
#else
uniform sampler2D picture;
in vec3 p, n; in vec2 t; in vec4 now, before;
layout(location = 0) out vec2 out_normal;
layout(location = 1) out vec4 out_albedo;
layout(location = 2) out vec4 out_specular;
layout(location = 3) out vec4 out_emissive;
layout(location = 4) out vec2 out_motion;
layout(location = 5) out vec4 out_place;
vec2 octahedral(vec3 v) {
    vec2 q = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    vec2 s = mix(vec2(-1.0), vec2(1.0), greaterThanEqual(q, vec2(0.0)));
    return v.z >= 0.0 ? q : (1.0 - abs(q.yx)) * s;
}
void main() {
    vec3 unit = normalize(n);
    // The side that is seen.
    unit = dot(unit, eye - p) < 0.0 ? -unit : unit;
    vec3 base = color * texture(picture, t).rgb;
    out_normal = octahedral(unit);
    // What the specular part reflects, the diffuse part lacks.
    float share = lobe(vec3(0.04), roughness, dot(unit, normalize(eye - p))).x;
    out_albedo = vec4(base * (1.0 - metallic) * (1.0 - share), 1.0);
    out_specular = vec4(mix(vec3(0.04), base, metallic), roughness);
    out_emissive = vec4(emission, 1.0);
    // Texture coordinates then minus now: rows run from the top and so does clip space here.
    out_motion = (before.xy / before.w - now.xy / now.w) * 0.5;
    out_place = vec4(p, 1.0);
}
#endif
"""

SHADOW = """
#version 430
uniform mat4 clip_from_world, world;
#ifdef VERTEX
in vec3 position;
void main() { gl_Position = clip_from_world * world * vec4(position, 1.0); }
#else
void main() {}
#endif
"""

SCREEN = "#version 430\nvoid main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }"

# Shared by fragments: octahedral normals, and the share of even light that a lobe shows, of which the split sum is that
# of bouncelight's `shaders/lib/brdf.wgsl`, so that pictures can be compared.
SHARED = """
vec3 decoded(vec2 e) {
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float t = max(-n.z, 0.0);
    n.xy -= mix(vec2(-t), vec2(t), greaterThanEqual(n.xy, vec2(0.0)));
    return normalize(n);
}
vec3 lobe(vec3 f0, float roughness, float n_v) {
    float x = 1.0 - clamp(n_v, 0.0, 1.0), r = clamp(roughness, 0.0, 1.0), s = max(r, 0.1);
    float exponent = (6.0393 + 26.2500 * r * r) * exp(-3.1851 * r);
    float rim = 1.2024 + r * (-3.4406 + r * (3.4447 - r * 1.1744));
    float bias = clamp(pow(max(x, 1e-6), exponent) * rim + 0.01503 * r * (1.0 - r), 0.0, 1.0);
    vec4 q = vec4(1.0, s, s * s, s * s * s);
    float scale = dot(vec4(0.9051, 0.9982, -2.4025, 0.7910), q)
        + x * (dot(vec4(0.3306, -3.0833, 5.2607, -2.3697), q)
        + x * (dot(vec4(-2.2334, 20.9684, -41.1089, 23.1553), q)
        + x * (dot(vec4(6.3627, -54.4488, 103.1189, -56.3863), q)
        + x * dot(vec4(-5.7047, 38.8754, -67.3500, 35.1796), q))));
    return f0 * clamp(scale, 0.0, 1.0 - bias) + bias;
}
"""

# Direct diffuse light as E/π, one view of a shadow map at a time, added up.
LIGHT = """
#version 430
uniform sampler2D normals, places;
uniform sampler2DShadow shadow;
uniform mat4 clip_from_world;
uniform vec3 strength, place, back;
uniform bool sun;
// Width of a texel of the map: of a sun, metres; of a lamp, over the distance.
uniform float texel;
out vec4 light;
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 p = texelFetch(places, pixel, 0);
    vec3 n = decoded(texelFetch(normals, pixel, 0).xy);
    vec3 to = sun ? back : place - p.xyz;
    float square = sun ? 1.0 : dot(to, to);
    vec3 l = normalize(to);
    vec4 q = clip_from_world * vec4(p.xyz + n * (0.002 + 3.0 * texel * (sun ? 1.0 : sqrt(square))), 1.0);
    vec3 c = q.xyz / q.w;
    bool within = p.w > 0.0 && q.w > 0.0 && all(lessThan(abs(c), vec3(1.0)));
    float seen = 0.0;
    for (int i = 0; i < 9; i++) {
        vec2 shift = vec2(i % 3 - 1, i / 3 - 1) / vec2(textureSize(shadow, 0));
        seen += texture(shadow, vec3(c.xy * 0.5 + 0.5 + shift, c.z * 0.5 + 0.5)) / 9.0;
    }
    light = vec4(within ? strength * max(dot(n, l), 0.0) / square * seen / 3.14159265 : vec3(0.0), 0.0);
}
"""

COMPOSITE = """
#version 430
uniform sampler2D albedo, emissive, direct, indirect, specular, places;
uniform vec3 sky;
uniform bool with_direct, with_indirect;
out vec4 color;
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 light = (with_direct ? texelFetch(direct, pixel, 0).rgb : vec3(0.0))
        + (with_indirect ? texelFetch(indirect, pixel, 0).rgb : vec3(0.0));
    vec3 hdr = texelFetch(albedo, pixel, 0).rgb * light + texelFetch(emissive, pixel, 0).rgb;
    if (with_indirect) { hdr += texelFetch(specular, pixel, 0).rgb; }
    hdr = texelFetch(places, pixel, 0).w > 0.0 ? hdr : sky;
    vec3 v = clamp(hdr, 0.0, 1.0);
    color = vec4(mix(12.92 * v, 1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, greaterThan(v, vec3(0.0031308))), 1.0);
}
"""


def perspective(yfov, aspect, near, far):
    """OpenGL's, row-major: clip space −w to w, y up."""
    f = 1 / np.tan(yfov / 2)
    a, b = (far + near) / (near - far), 2 * far * near / (near - far)
    return np.array([[f / aspect, 0, 0, 0], [0, f, 0, 0], [0, 0, a, b], [0, 0, -1, 0]])


def looking(eye, back, up):
    """View from world."""
    z = back / np.linalg.norm(back)
    x = np.cross(up, z)
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = rotation, -rotation @ eye
    return view


class Renderer:
    """Draws `scene` into textures of `size`."""

    FAR = 100.0

    def __init__(self, ctx, scene, size):
        self.ctx, self.scene, self.size = ctx, scene, size

        def program(text):
            stages = (f"#version 430\n#define {stage}\n{SHARED}" for stage in ("VERTEX", "FRAGMENT"))
            return ctx.program(*(text.replace("#version 430", stage) for stage in stages))

        def screen(text):
            return ctx.program(SCREEN, text.replace("#version 430", "#version 430\n" + SHARED))

        self.geometry, self.shadow = program(GEOMETRY), program(SHADOW)
        self.light, self.composite = screen(LIGHT), screen(COMPOSITE)
        self.light_screen, self.composite_screen = (ctx.vertex_array(p, []) for p in (self.light, self.composite))
        white = ctx.texture((1, 1), 4, b"\xff" * 4)
        pictures = [self._picture(image) for image in scene.images]
        self.draws = []
        for draw in scene.draws:
            vertices, indices = ctx.buffer(draw["vertices"]), ctx.buffer(draw["indices"])
            lit = ctx.vertex_array(self.geometry, [(vertices, "3f 3f 2f", "position", "normal", "uv")], indices)
            dark = ctx.vertex_array(self.shadow, [(vertices, "3f 20x", "position")], indices)
            self.draws.append((draw, lit, dark, white if draw["image"] is None else pictures[draw["image"]]))
        self.targets = {
            "normal": ctx.texture(size, 2, dtype="f2"),
            "albedo": ctx.texture(size, 4, dtype="f2"),
            "specular": ctx.texture(size, 4, dtype="f1"),
            "emissive": ctx.texture(size, 4, dtype="f2"),
            "motion": ctx.texture(size, 2, dtype="f2"),
            "place": ctx.texture(size, 4, dtype="f4"),
        }
        self.depth = ctx.depth_texture(size)
        self.depth.compare_func = ""
        self.depth.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.gbuffer = ctx.framebuffer(list(self.targets.values()), self.depth)
        self.direct = ctx.texture(size, 4, dtype="f2")
        self.lit = ctx.framebuffer([self.direct])
        self.shown = ctx.framebuffer([ctx.texture(size, 4)])
        self.views = self._shadows()
        self.before = None

    def _picture(self, image):
        # sRGB8_ALPHA8: the texture unit decodes.
        texture = self.ctx.texture(image.size, 4, image.tobytes(), internal_format=0x8C43)
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        return texture

    def _shadows(self):
        """One map for a sun, six for a lamp: light, matrix, map, width of a texel. The scene stands still, so they are drawn once."""
        low, high = self.scene.bounds()
        centre, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
        views = []
        for light in self.scene.lights:
            if light["kind"] == "directional":
                back = light["back"] / np.linalg.norm(light["back"])
                up = np.array([0, 1, 0]) if abs(back[1]) < 0.9 else np.array([1, 0, 0])
                box = np.diag([1 / radius, 1 / radius, -1 / radius, 1.0])
                views.append((light, box @ looking(centre, back, up), 2048, 2 * radius / 2048))
            else:
                for axis in range(3):
                    for sign in (1, -1):
                        back, up = np.zeros(3), np.roll([0.0, 1.0, 0.0], axis)
                        back[axis] = sign
                        matrix = perspective(np.pi / 2, 1, 0.02, 2 * radius) @ looking(light["place"], back, up)
                        views.append((light, matrix, 1024, 2 / 1024))
        return [(light, matrix, self._map(matrix, side), texel) for light, matrix, side, texel in views]

    def _map(self, matrix, side):
        texture = self.ctx.depth_texture((side, side))
        texture.compare_func = "<="
        self.ctx.framebuffer([], texture).use()
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.clear(depth=1.0)
        for draw, _, dark, _ in self.draws:
            self._set(self.shadow, clip_from_world=matrix, world=draw["world"])
            dark.render()
        return texture

    @staticmethod
    def _set(program, **values):
        for name, value in values.items():
            if name in program:
                value = np.asarray(value, "f4")
                program[name].write((value.T if value.ndim == 2 else value).tobytes())

    def camera(self, shift=(0.0, 0.0, 0.0)):
        """View and projection (y up) of the scene's camera, moved by `shift` in its own frame, metres."""
        c = self.scene.camera
        world = c["world"].copy()
        world[:3, 3] += world[:3, :3] @ np.asarray(shift)
        return np.linalg.inv(world), perspective(c["yfov"], self.size[0] / self.size[1], c["near"], self.FAR)

    def draw(self, view, projection):
        """Fills G-buffers and direct light; what the pass takes of them."""
        clip = np.diag([1.0, -1.0, 1.0, 1.0]) @ projection @ view
        eye = -view[:3, :3].T @ view[:3, 3]
        self.gbuffer.use()
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.clear(depth=1.0)
        before = clip if self.before is None else self.before
        for draw, lit, _, picture in self.draws:
            picture.use(0)
            self._set(self.geometry, clip_from_world=clip, clip_before=before, eye=eye, **{
                k: draw[k] for k in ("world", "color", "emission", "metallic", "roughness")})
            lit.render()
        self.before, self.eye = clip, eye
        self._light()
        inputs = {k: self.targets[k] for k in ("normal", "albedo", "specular", "emissive", "motion")}
        return {"depth": self.depth, "direct": self.direct, **inputs}

    def _light(self):
        self.lit.use()
        self.ctx.clear()
        self.ctx.enable_only(moderngl.BLEND)
        self.ctx.blend_func = moderngl.ONE, moderngl.ONE
        self.targets["normal"].use(0)
        self.targets["place"].use(1)
        self.light["normals"], self.light["places"], self.light["shadow"] = 0, 1, 2
        for light, matrix, shadow, texel in self.views:
            shadow.use(2)
            self.light["sun"] = light["kind"] == "directional"
            self._set(self.light, clip_from_world=matrix, texel=texel, **{k: light[k] for k in ("strength", "place", "back")})
            self.light_screen.render(vertices=3)
        self.ctx.enable_only(moderngl.NOTHING)

    def show(self, gi, direct=True, light=True):
        """The picture, rows from the top; `light`: with what the pass found for diffuse surfaces and for lobes."""
        self.shown.use()
        t = self.targets
        pictures = {"albedo": t["albedo"], "emissive": t["emissive"], "direct": self.direct, "indirect": gi.output,
                    "specular": gi.specular, "places": t["place"]}
        self._set(self.composite, sky=gi.sky)
        for slot, (name, texture) in enumerate(pictures.items()):
            texture.use(slot)
            self.composite[name] = slot
        self.composite["with_direct"], self.composite["with_indirect"] = direct, light
        self.composite_screen.render(vertices=3)
        return np.frombuffer(self.shown.read(components=3, alignment=1), "u1").reshape(self.size[1], self.size[0], 3)
