//! Indirect light for Bevy by [`bouncelight`]: rays into the triangles that Bevy draws.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_bouncelight::{Bouncelight, BouncelightPlugin};
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, BouncelightPlugin::default()))
//!     .add_systems(Startup, |mut commands: Commands| {
//!         commands.spawn((Camera3d::default(), Bouncelight));
//!     })
//!     .run();
//! ```
//!
//! ```text
//!  main world, Last              extraction        Render                  Core3d
//!  meshes, materials, places, ─► Collected moves ─► World::prepare, Views ─► prepasses, direct light (Bevy)
//!  lights, sky: `collect`        (`collect::take`)  (`pass::prepare`)       ─► `pass::light`: View::record, composite
//! ```
//!
//! Bevy's light is photometric and the pass's radiometric: what comes in is divided by
//! [`LUMENS_PER_WATT`], what goes out multiplied by it and by the camera's exposure.

mod collect;
pub mod headless;
mod pass;

use bevy::camera::Hdr;
use bevy::core_pipeline::core_3d::{main_opaque_pass_3d, main_transparent_pass_3d};
use bevy::core_pipeline::prepass::{DeferredPrepass, DepthPrepass, MotionVectorPrepass, NormalPrepass};
use bevy::core_pipeline::schedule::{Core3d, Core3dSystems};
use bevy::light::AmbientLight;
use bevy::pbr::DefaultOpaqueRendererMethod;
use bevy::pbr::deferred::deferred_lighting;
use bevy::prelude::*;
use bevy::render::extract_component::{ExtractComponent, ExtractComponentPlugin};
use bevy::render::{ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems};

pub use pass::{Complaints, Views};

/// Lumens of a watt of light, as this crate has it.
pub const LUMENS_PER_WATT: f32 = 683.0;

/// Gives cameras with [`Bouncelight`] the light that Bevy's lights leave out: every bounce, what
/// glows, and the sky ([`GlobalAmbientLight`]). Opaque materials are drawn deferred from then on,
/// which it reads albedo from: Bevy shows them to cameras with a [`DeferredPrepass`] alone.
#[derive(Debug, Clone, Copy, Default)]
pub struct BouncelightPlugin {
    /// After eight frames of a camera asks [`bouncelight::gi::View::check`] whether what it was
    /// given makes sense, and logs what it finds. Waits for the GPU: for tests and debug builds.
    pub check: bool,
}

/// Lights what this camera shows. With it come a deferred, depth, normal and motion prepass and an
/// HDR target; samples of edges go ([`Msaa::Off`]), and so does the camera's share of
/// [`GlobalAmbientLight`], which rays find.
#[derive(Component, ExtractComponent, Debug, Clone, Copy, Default)]
#[extract_app(RenderApp)]
pub struct Bouncelight;

impl Plugin for BouncelightPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(ExtractComponentPlugin::<Bouncelight>::default())
            .insert_resource(DefaultOpaqueRendererMethod::deferred())
            .init_resource::<collect::Collected>()
            .init_resource::<collect::Known>()
            .add_observer(equip)
            .add_systems(Last, collect::collect);
        let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
        render
            .init_resource::<pass::Views>()
            .init_resource::<Complaints>()
            .add_systems(RenderStartup, pass::start)
            .add_systems(ExtractSchedule, collect::take)
            .add_systems(Render, pass::prepare.in_set(RenderSystems::PrepareResources))
            .add_systems(
                Core3d,
                pass::light
                    .after(deferred_lighting)
                    .after(main_opaque_pass_3d)
                    .before(main_transparent_pass_3d)
                    .in_set(Core3dSystems::MainPass),
            );
        if self.check {
            render.add_systems(Render, pass::check.in_set(RenderSystems::Cleanup));
        }
    }
}

/// What comes with [`Bouncelight`]. Inserted, not required: a camera that is there already has
/// samples and no HDR target.
pub fn equipment() -> impl Bundle {
    let none = AmbientLight { brightness: 0.0, ..Default::default() };
    let prepasses = (DepthPrepass, NormalPrepass, MotionVectorPrepass, DeferredPrepass);
    (prepasses, Hdr, Msaa::Off, none)
}

fn equip(added: On<Add<Bouncelight>>, mut commands: Commands) {
    commands.entity(added.entity).insert(equipment());
}
