//! What the passes of `gather` bind, by the names that the shaders' variables have. A test compares
//! them with the shaders.

use super::params::ParamsRing;
use crate::gpu::bind::Bound;
use crate::gpu::binding::{LOAD, READ, READ_WRITE, STORE_HALF};

/// Texels that are whole numbers, read one by one.
const LOAD_UINT: wgpu::BindingType = wgpu::BindingType::Texture {
    sample_type: wgpu::TextureSampleType::Uint,
    view_dimension: wgpu::TextureViewDimension::D2,
    multisampled: false,
};

/// A group's bindings in the order of their numbers.
macro_rules! bindings {
    ($($(#[$doc:meta])* $group:ident { $($name:ident: $kind:expr),+ $(,)? })+) => { $(
        $(#[$doc])*
        #[derive(Clone)]
        pub(super) struct $group {
            $(pub $name: Bound,)+
        }

        impl $group {
            pub const TYPES: &[wgpu::BindingType] = &[$($kind),+];
            #[cfg(test)]
            pub const NAMES: &[&str] = &[$(stringify!($name)),+];
        }

        impl From<$group> for Vec<Bound> {
            fn from(group: $group) -> Self {
                vec![$(group.$name),+]
            }
        }
    )+ };
}

bindings! {
    /// The frame's parameters and the scene as rays meet it: group 1 of passes that send rays.
    Scene {
        gather: ParamsRing::TYPE,
        accel_blocks: LOAD_UINT,
        surfaces: READ,
        emitters: READ,
        lights: READ,
        environment_picture: LOAD,
        corner_normals: LOAD_UINT,
    }
    /// The frame's parameters alone: group 1 of the others.
    Alone {
        gather: ParamsRing::TYPE,
    }
    /// `gi.gradient`.
    Gradient {
        entry_keys: READ_WRITE,
        entry_lots: READ_WRITE,
        entry_queries: READ_WRITE,
        before: READ,
        records: READ_WRITE,
    }
    /// `gi.recall` and `gi.settle`.
    History {
        cell_pixels: READ_WRITE,
        records: READ_WRITE,
        entry_light: READ,
        before: READ,
        after: READ_WRITE,
        changes: READ,
        motion_map: LOAD,
        specular_map: LOAD,
    }
    /// `gi.rays`.
    CellRays {
        entry_keys: READ_WRITE,
        entry_lots: READ_WRITE,
        entry_queries: READ_WRITE,
        cell_pixels: READ,
        records: READ_WRITE,
        specular_map: LOAD,
    }
    /// `gi.evict` and `gi.renew`.
    Entries {
        entry_keys: READ_WRITE,
        entry_lots: READ_WRITE,
        entry_queries: READ_WRITE,
        entry_asked: READ_WRITE,
        entry_light: READ_WRITE,
    }
    /// `gi.mirror`.
    Mirror {
        entry_keys: READ_WRITE,
        entry_lots: READ_WRITE,
        entry_queries: READ_WRITE,
        entry_light: READ,
        mirrored: READ_WRITE,
        specular_map: LOAD,
        motion_map: LOAD,
    }
    /// `gi.blur`.
    Blur {
        pasts: READ,
        light: READ_WRITE,
        changes: READ_WRITE,
        glosses: READ_WRITE,
        guidance: READ,
    }
    /// `gi.smooth`.
    Smooth {
        pasts: READ,
        blurred: READ,
        light: READ_WRITE,
        guidance: READ,
        glosses: READ,
        gleams: READ_WRITE,
    }
    /// `gi.bring`.
    Bring {
        cell_pixels: READ,
        light: READ,
        glosses: READ,
        output: STORE_HALF,
        specular_output: STORE_HALF,
        specular_map: LOAD,
        mirrored: READ,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders;

    /// Variables of a shader's group by the numbers of their bindings.
    fn variables(shader: &str, prelude: &str, group: u32) -> Vec<(u32, String)> {
        let text = shaders::source(shader, prelude);
        let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        let of = |v: &naga::GlobalVariable| {
            let binding = v.binding.as_ref().filter(|b| b.group == group)?;
            Some((binding.binding, v.name.clone()?))
        };
        module.global_variables.iter().filter_map(|(_, v)| of(v)).collect()
    }

    #[test]
    fn bindings_have_the_names_of_the_shaders_variables() {
        let (prelude, bring) = (super::super::prelude(), super::super::bring::prelude());
        let rows: [(&str, &str, u32, &[&str]); 16] = [
            ("gi.rays", &prelude, 1, Scene::NAMES),
            ("gi.renew", &prelude, 1, Scene::NAMES),
            ("gi.gradient", &prelude, 1, Scene::NAMES),
            ("gi.mirror", &prelude, 1, Scene::NAMES),
            ("gi.gradient", &prelude, 2, Gradient::NAMES),
            ("gi.recall", &prelude, 2, History::NAMES),
            ("gi.settle", &prelude, 2, History::NAMES),
            ("gi.rays", &prelude, 2, CellRays::NAMES),
            ("gi.renew", &prelude, 2, Entries::NAMES),
            ("gi.mirror", &prelude, 2, Mirror::NAMES),
            ("gi.blur", &prelude, 2, Blur::NAMES),
            ("gi.smooth", &prelude, 2, Smooth::NAMES),
            ("gi.bring", &bring, 1, Bring::NAMES),
            ("gi.settle", &prelude, 1, Scene::NAMES),
            ("gi.blur", &prelude, 1, Scene::NAMES),
            ("gi.smooth", &prelude, 1, Scene::NAMES),
        ];
        let mut compared = 0;
        for (shader, prelude, group, names) in rows {
            let found = variables(shader, prelude, group);
            for (binding, name) in &found {
                assert_eq!(names.get(*binding as usize), Some(&name.as_str()), "{shader}, binding {binding}");
            }
            compared += found.len();
        }
        assert!(compared > 60, "{compared}");
        assert_eq!(Alone::NAMES, &Scene::NAMES[..1]);
    }
}
