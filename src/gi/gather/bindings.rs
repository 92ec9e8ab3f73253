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
        entry_proposals: READ_WRITE,
        proposal_vertices: READ_WRITE,
        history_prev: READ,
        records: READ_WRITE,
    }
    /// `gi.reproject` and `gi.accumulate`.
    Temporal {
        cell_pixels: READ_WRITE,
        records: READ_WRITE,
        entry_light: READ,
        history_prev: READ,
        history_next: READ_WRITE,
        changes: READ,
        motion_map: LOAD,
        specular_map: LOAD,
        jobs: READ_WRITE,
    }
    /// `gi.trace`.
    Trace {
        entry_keys: READ_WRITE,
        entry_proposals: READ_WRITE,
        proposal_vertices: READ_WRITE,
        noted_jobs: READ,
        records: READ_WRITE,
        specular_map: LOAD,
    }
    /// `gi.cache_evict` and `gi.cache_select`.
    CacheSelect {
        entry_keys: READ_WRITE,
        entry_proposals: READ_WRITE,
        proposal_vertices: READ_WRITE,
        entry_last_used: READ_WRITE,
        entry_light: READ_WRITE,
        jobs: READ_WRITE,
    }
    /// `gi.cache_update`.
    CacheUpdate {
        entry_keys: READ_WRITE,
        entry_proposals: READ_WRITE,
        proposal_vertices: READ_WRITE,
        entry_light: READ_WRITE,
        noted_jobs: READ,
    }
    /// `gi.specular_trace`.
    SpecularTrace {
        entry_keys: READ_WRITE,
        entry_proposals: READ_WRITE,
        proposal_vertices: READ_WRITE,
        entry_light: READ,
        pixel_specular: READ_WRITE,
        specular_map: LOAD,
        motion_map: LOAD,
    }
    /// `gi.blur`.
    Blur {
        histories: READ,
        light_blurred: READ_WRITE,
        changes: READ_WRITE,
        specular_blurred: READ_WRITE,
        guidance: READ,
    }
    /// `gi.atrous`.
    Atrous {
        histories: READ,
        light_blurred: READ,
        cell_light: READ_WRITE,
        guidance: READ,
        specular_blurred: READ,
        specular_filtered: READ_WRITE,
    }
    /// `gi.upsample`.
    Upsample {
        cell_pixels: READ,
        cell_light: READ,
        specular_filtered: READ,
        output: STORE_HALF,
        specular_output: STORE_HALF,
        specular_map: LOAD,
        pixel_specular: READ,
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
        let (prelude, upsample) = (super::super::prelude(), super::super::upsample::prelude());
        let rows: [(&str, &str, u32, &[&str]); 17] = [
            ("gi.trace", &prelude, 1, Scene::NAMES),
            ("gi.cache_update", &prelude, 1, Scene::NAMES),
            ("gi.gradient", &prelude, 1, Scene::NAMES),
            ("gi.specular_trace", &prelude, 1, Scene::NAMES),
            ("gi.gradient", &prelude, 2, Gradient::NAMES),
            ("gi.reproject", &prelude, 2, Temporal::NAMES),
            ("gi.accumulate", &prelude, 2, Temporal::NAMES),
            ("gi.trace", &prelude, 2, Trace::NAMES),
            ("gi.cache_select", &prelude, 2, CacheSelect::NAMES),
            ("gi.cache_update", &prelude, 2, CacheUpdate::NAMES),
            ("gi.specular_trace", &prelude, 2, SpecularTrace::NAMES),
            ("gi.blur", &prelude, 2, Blur::NAMES),
            ("gi.atrous", &prelude, 2, Atrous::NAMES),
            ("gi.upsample", &upsample, 1, Upsample::NAMES),
            ("gi.accumulate", &prelude, 1, Scene::NAMES),
            ("gi.blur", &prelude, 1, Scene::NAMES),
            ("gi.atrous", &prelude, 1, Scene::NAMES),
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
