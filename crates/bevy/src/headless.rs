//! Bevy without a window: frames one after the other, and pictures of them.

use crate::collect::Known;
use bevy::app::PluginsState;
use bevy::asset::RenderAssetUsages;
use bevy::camera::{Exposure, RenderTarget};
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::tasks::tick_global_task_pools_on_main_thread;
use bevy::window::ExitCondition;
use std::sync::{Arc, Mutex};

/// An app whose cameras draw into an image.
pub struct Headless {
    /// The app; plugins and systems are added before the first frame.
    pub app: App,
    target: Handle<Image>,
    started: bool,
}

impl Headless {
    /// Bevy's plugins without a window; `folder` holds its assets. Nothing is left to chance:
    /// pipelines are compiled before they are used, and a frame is drawn when [`Headless::frame`]
    /// returns.
    pub fn new(size: [u32; 2], folder: &str) -> Self {
        let mut app = App::new();
        let plugins = DefaultPlugins
            .set(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
            .set(AssetPlugin { file_path: folder.into(), ..default() })
            .set(RenderPlugin { synchronous_pipeline_compilation: true, ..default() })
            .disable::<PipelinedRenderingPlugin>();
        app.add_plugins(plugins).insert_resource(ClearColor(Color::BLACK));
        // What files hold is spawned by reflection; Bevy's default features do this
        // (`reflect_auto_register`).
        app.world().resource::<AppTypeRegistry>().write().register_derived_types();
        let mut image = Image::new_target_texture(size[0], size[1], TextureFormat::Rgba8UnormSrgb, None);
        image.asset_usage = RenderAssetUsages::default();
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
        Self { app, target, started: false }
    }

    /// For a camera that draws into the image: no tonemapping, and 1 W/(m²·sr) is 1.
    pub fn camera(&self) -> impl Bundle + use<> {
        let exposure = Exposure { ev100: (crate::LUMENS_PER_WATT / 1.2).log2() };
        (RenderTarget::Image(self.target.clone().into()), Tonemapping::None, DebandDither::Disabled, exposure)
    }

    /// Draws a frame.
    pub fn frame(&mut self) {
        if !self.started {
            while self.app.plugins_state() == PluginsState::Adding {
                tick_global_task_pools_on_main_thread();
            }
            self.app.finish();
            self.app.cleanup();
            self.started = true;
        }
        self.app.update();
    }

    /// Draws frames until `ready` and until rays have all meshes; false if that takes more than
    /// `frames`.
    pub fn wait(&mut self, frames: usize, ready: impl Fn(&mut World) -> bool) -> bool {
        for _ in 0..frames {
            self.frame();
            let there = self.app.world().get_resource::<Known>().is_none_or(Known::there);
            if there && ready(self.app.world_mut()) {
                return true;
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        false
    }

    /// The image: four bytes a pixel, rows from the top. Draws frames until it has come.
    pub fn picture(&mut self) -> Option<Image> {
        let shot: Arc<Mutex<Option<Image>>> = Arc::default();
        let into = shot.clone();
        let mut screenshot = self.app.world_mut().spawn(Screenshot::image(self.target.clone()));
        screenshot.observe(move |mut captured: On<ScreenshotCaptured>| {
            *into.lock().expect("no panic holds it") = Some(std::mem::take(&mut captured.image));
        });
        for _ in 0..100 {
            self.frame();
            if let Some(image) = shot.lock().expect("no panic holds it").take() {
                return Some(image);
            }
        }
        None
    }
}
