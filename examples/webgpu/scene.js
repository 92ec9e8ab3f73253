// As much of glTF as this page draws: triangles with constant colour, the first camera. Not read: pictures, lamps and
// suns, alpha, skins, animations.

const ARRAYS = { 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };

export async function loadScene(url) {
  const data = await (await fetch(url)).arrayBuffer();
  const size = new DataView(data).getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 20, size)));
  const array = (index) => {
    const { bufferView, byteOffset = 0, componentType, type, count } = json.accessors[index];
    const from = 28 + size + (json.bufferViews[bufferView].byteOffset ?? 0) + byteOffset;
    const Kind = ARRAYS[componentType];
    return new Kind(data.slice(from, from + count * WIDTHS[type] * Kind.BYTES_PER_ELEMENT));
  };
  const scene = { draws: [], camera: null };
  for (const node of json.nodes) {
    const world = node.matrix ?? [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
    if (node.camera !== undefined) scene.camera ??= { world, ...json.cameras[node.camera].perspective };
    for (const { attributes, indices, material } of json.meshes[node.mesh]?.primitives ?? []) {
      const m = json.materials[material];
      const strength = m.extensions?.KHR_materials_emissive_strength?.emissiveStrength ?? 1;
      scene.draws.push({
        world,
        positions: array(attributes.POSITION),
        normals: array(attributes.NORMAL),
        indices: Uint32Array.from(array(indices)),
        color: m.pbrMetallicRoughness.baseColorFactor.slice(0, 3),
        metallic: m.pbrMetallicRoughness.metallicFactor,
        roughness: m.pbrMetallicRoughness.roughnessFactor,
        emission: m.emissiveFactor.map((e) => e * strength),
      });
    }
  }
  return scene;
}
