//! Another unit of length or vertical than glTF's: a node above all others.

use crate::units::Units;
use gltf::json::{Index, Node, Root, scene::UnitQuaternion};

/// Puts the scene that is shown below one more node, and measures what no node's scale reaches:
/// planes of cameras and ranges of lights.
pub(super) fn apply(root: &mut Root, units: Units) {
    if units == Units::default() {
        return;
    }
    for lens in root.cameras.iter_mut().filter_map(|c| c.perspective.as_mut()) {
        lens.znear *= units.scale;
        lens.zfar = lens.zfar.map(|far| far * units.scale);
    }
    for lens in root.cameras.iter_mut().filter_map(|c| c.orthographic.as_mut()) {
        for length in [&mut lens.xmag, &mut lens.ymag, &mut lens.znear, &mut lens.zfar] {
            *length *= units.scale;
        }
    }
    let lights = root.extensions.as_mut().and_then(|e| e.khr_lights_punctual.as_mut());
    for range in lights.into_iter().flat_map(|l| &mut l.lights).filter_map(|l| l.range.as_mut()) {
        *range *= units.scale;
    }
    let above = Index::new(u32::try_from(root.nodes.len()).unwrap_or(u32::MAX));
    let chosen = root.scene.map_or(0, |s| s.value());
    let children = match root.scenes.get_mut(chosen) {
        Some(scene) => std::mem::replace(&mut scene.nodes, vec![above]),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            let children = root.nodes.iter().flat_map(|n| n.children.iter().flatten());
            children.filter(|c| c.value() < root.nodes.len()).for_each(|c| is_child[c.value()] = true);
            (0..root.nodes.len()).filter(|n| !is_child[*n]).map(|n| Index::new(n as u32)).collect()
        }
    };
    root.nodes.push(Node {
        children: Some(children),
        name: Some("units".into()),
        rotation: Some(UnitQuaternion(units.turn().to_array())),
        scale: Some([units.scale; 3]),
        ..Node::default()
    });
}
