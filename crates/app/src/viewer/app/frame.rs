//! One picture of the window: hands, scene, overlay, in this order, so that what hands did is seen
//! at once.

use super::App;
use crate::viewer::command;
use crate::viewer::records;
use crate::viewer::screen::Acquired;
use crate::viewer::state::Request;
use bouncelight::gpu::{readback, timing::Recorder};
use std::path::Path;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;

/// Milliseconds from which on a frame is too slow to move by.
const SLOW: f64 = 50.0;

impl App {
    /// Draws the window, if it is to be seen. Tells when it wants to be called again by itself.
    pub fn frame(&mut self, event_loop: &ActiveEventLoop) {
        let anew = std::mem::take(&mut self.redraw);
        self.again = false;
        let (Some(screen), Some(stage)) = (&mut self.screen, &self.stage) else { return };
        let device = stage.gpu.device.clone();
        if !screen.fit(&device) {
            // What hands do is heard once there is a window again.
            self.overlay.defer(&mut self.scripted);
            return;
        }
        if !screen.is_alive(&stage.gpu.queue) {
            // Brings the news, which then builds everything anew.
            let _ = device.poll(wgpu::PollType::Poll);
            self.wake(Duration::from_millis(50));
            return;
        }
        let mut overlay = self.overlay(anew);
        let (density, place) = (self.overlay.density, self.overlay.place);
        let origin = [place.left(), place.top()].map(|n| (n * density).round().max(0.0) as u32);
        self.serve(event_loop);
        self.reconcile();

        let recording = Instant::now();
        let drawn = self.draw_scene();
        let mut cpu = overlay + recording.elapsed();

        let (Some(screen), Some(stage)) = (&mut self.screen, &mut self.stage) else { return };
        let painting = Instant::now();
        let queue = stage.gpu.queue.clone();
        let window = egui_wgpu::ScreenDescriptor { size_in_pixels: screen.size(), pixels_per_point: density };
        let mut encoder = device.create_command_encoder(&Default::default());
        let jobs = &self.overlay.jobs;
        let mut buffers = match std::mem::take(&mut self.overlay.changed) {
            true => screen.painter.update_buffers(&device, &queue, &mut encoder, jobs, &window),
            false => Vec::new(),
        };
        overlay += painting.elapsed();
        cpu += painting.elapsed();

        let screenshot = self.screenshot.take();
        let mut kept = None;
        let texture = match &screenshot {
            // Into a texture that can be read back, composed just the same.
            Some(_) => {
                let texture = device.create_texture(&wgpu::TextureDescriptor {
                    label: Some("viewer.screenshot"),
                    size: wgpu::Extent3d {
                        width: screen.size()[0],
                        height: screen.size()[1],
                        depth_or_array_layers: 1,
                    },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format: screen.format(),
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                    view_formats: &[],
                });
                self.redraw = true;
                texture
            }
            None => match screen.acquire(&device) {
                Acquired::Texture(texture) => kept.insert(texture).texture.clone(),
                Acquired::Again => {
                    self.redraw = true;
                    return;
                }
                Acquired::Hidden => {
                    self.wake(Duration::from_millis(100));
                    return;
                }
            },
        };
        let finishing = Instant::now();
        let view = texture.create_view(&Default::default());
        let timed = screen.profiler.as_ref().filter(|_| drawn);
        let mut recorder = match timed {
            Some(profiler) => Recorder::timed(&mut encoder, profiler),
            None => Recorder::new(&mut encoder),
        };
        let fill = self.overlay.egui.global_style().visuals.panel_fill;
        let shade = |c: u8| f64::from(c) / 255.0;
        let clear = wgpu::Color { r: shade(fill.r()), g: shade(fill.g()), b: shade(fill.b()), a: 1.0 };
        stage.present(&mut recorder, &self.state, origin, density, clear, &view);
        let attachment = wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
        };
        let query = timed.map(|p| p.begin_pass_query("viewer.overlay", &mut encoder));
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("viewer.overlay"),
            color_attachments: &[Some(attachment)],
            timestamp_writes: query.as_ref().and_then(|q| q.render_pass_timestamp_writes()),
            ..Default::default()
        });
        let painting = Instant::now();
        screen.painter.render(&mut pass.forget_lifetime(), jobs, &window);
        overlay += painting.elapsed();
        if let (Some(profiler), Some(query)) = (&mut screen.profiler, query) {
            profiler.end_query(&mut encoder, query);
            profiler.resolve_queries(&mut encoder);
        }
        buffers.push(encoder.finish());
        queue.submit(buffers);
        let mut timed = false;
        if drawn && let Some(profiler) = &mut screen.profiler {
            match profiler.end_frame() {
                Ok(()) => timed = true,
                Err(e) => tracing::debug!("a frame was not timed: {e}"),
            }
        }
        cpu += finishing.elapsed();
        let cpu = cpu.as_secs_f64() * 1e3;
        if timed {
            self.meter.timed(cpu);
        }
        if let Some(texture) = kept {
            screen.window.pre_present_notify();
            queue.present(texture);
        }
        for id in self.overlay.freed.drain(..) {
            screen.painter.free_texture(&id);
        }
        if drawn && screen.profiler.is_none() {
            // Without timestamps the clock has to do.
            if device.poll(wgpu::PollType::wait_indefinitely()).is_ok() {
                if self.meter.settling < 2 {
                    self.meter.times.waited(Instant::now(), recording.elapsed().as_secs_f64() * 1e3, cpu);
                }
                self.learn();
            }
        }
        if let Some(path) = screenshot
            && let Err(e) = save_screenshot(&device, &queue, &texture, &path)
        {
            self.fail(e);
        }
        if drawn && self.meter.settling > 0 {
            self.meter.settling -= 1;
        }
        self.frames += 1;
        if drawn {
            self.meter.times.now.cpu.add(Instant::now(), cpu);
        }
        self.meter.times.overlay.add(Instant::now(), overlay.as_secs_f64() * 1e3);
        self.collect_times();
        self.count_rays();
        self.tour();
        self.schedule(drawn);
    }

    /// Records and submits the scene's next frame, if one is due.
    fn draw_scene(&mut self) -> bool {
        let (Some(stage), Some(shown)) = (&mut self.stage, &self.state.shown) else { return false };
        let stale = std::mem::take(&mut self.state.stale);
        if let Err(e) = stage.refresh(&shown.scene, stale) {
            self.state.notify(e, true);
            return false;
        }
        let camera = self.state.navigator.camera(&shown.scene, self.state.size);
        let track = if self.screen.as_ref().is_some_and(|s| s.profiler.is_some()) {
            &self.meter.times.now.gpu
        } else {
            &self.meter.times.now.wall
        };
        // Frames of half the resolution take a quarter.
        let most = if self.state.slow { SLOW / 4.0 } else { SLOW };
        self.state.slow = track.spread().is_some_and(|s| s.median > most);
        let again = self.state.measure || self.meter.settling == 1;
        let mut encoder = stage.gpu.device.create_command_encoder(&Default::default());
        let profiler = self.screen.as_ref().and_then(|s| s.profiler.as_ref());
        let mut recorder = match profiler {
            Some(profiler) => Recorder::timed(&mut encoder, profiler),
            None => Recorder::new(&mut encoder),
        };
        let drawn = match stage.draw(&mut recorder, &self.state, &camera, again) {
            Ok(drawn) => drawn,
            Err(e) => {
                self.state.notify(e.to_string(), true);
                false
            }
        };
        if drawn {
            stage.gpu.queue.submit([encoder.finish()]);
            self.scene_frames += 1;
            if self.state.settings.flicker {
                match stage.measure_flicker(&self.state) {
                    Ok(found) => self.meter.flicker = found.or(self.meter.flicker.filter(|_| stage.still() > 1)),
                    Err(e) => self.state.notify(e.to_string(), true),
                }
            }
            if stage.still() == 1 {
                self.tracing.verdict = None;
            }
            if !stage.is_converging(&self.state) && self.state.sources().len() == 2 {
                self.tracing.judge_at = Some(Instant::now() + Duration::from_millis(200));
            }
        }
        if let Err(e) = stage.update_feature(&self.state, &camera) {
            self.state.notify(e, true);
        }
        if drawn {
            self.mark_run();
        }
        self.expose();
        drawn
    }

    /// Measures the exposure, if that is wished: in the first frame of a scene, and again at rest
    /// whenever something else than the camera has changed meanwhile.
    fn expose(&mut self) {
        let (Some(stage), Some(shown)) = (&self.stage, &self.state.shown) else { return };
        let first = self.state.measured.is_none() && stage.still() > 0;
        let now = (self.state.version, stage.key(0), stage.wants_rays());
        let rests = !stage.is_converging(&self.state) && self.meter.exposed != Some(now);
        if !self.state.auto_exposure || !(first || rests) || stage.key(0).is_none() {
            return;
        }
        let sky = &shown.scene.environment;
        let background = sky.image.is_none().then_some(sky.radiance);
        match stage.read_left(&self.state) {
            Ok(Some(rgb)) => {
                if rests {
                    self.meter.exposed = Some(now);
                }
                let stops = bouncelight::render::exposure::measure(&rgb, 3, background);
                self.redraw |= self.state.measured != Some(stops);
                self.state.measured = Some(stops);
            }
            Ok(None) => {}
            Err(e) => self.state.notify(e.to_string(), true),
        }
    }

    /// When the next picture is due.
    fn schedule(&mut self, drawn: bool) {
        if drawn {
            self.overlay.outdate();
        }
        let converging = self.stage.as_ref().is_some_and(|s| s.is_converging(&self.state));
        let measuring = self.state.measure && self.stage.as_ref().is_some_and(|s| s.has_scene());
        let follows = converging || measuring || self.meter.settling == 1 || self.again;
        self.again = follows;
        if drawn {
            self.meter.follow(Instant::now(), follows);
        }
        if self.redraw || self.again {
            self.request_redraw();
        }
    }

    fn copy(&mut self, text: String) {
        self.overlay.egui.copy_text(text.clone());
        if let Some(screen) = self.screen.as_mut().filter(|_| self.script.is_none()) {
            screen.input.set_clipboard_text(text.clone());
        }
        self.copied = Some(text);
    }

    /// Does what the state asks of the world outside.
    fn serve(&mut self, event_loop: &ActiveEventLoop) {
        for request in std::mem::take(&mut self.state.requests) {
            match request {
                Request::Quit => self.quit(event_loop),
                Request::CopyCommand => {
                    self.copy(command::line(&self.state, None));
                }
                Request::CopyTimes => {
                    if let Some(about) = self.about() {
                        self.copy(records::table(&self.meter.times, &about));
                    }
                }
                Request::FullScreen(full) => {
                    if let Some(screen) = &self.screen {
                        let whole = full.then_some(winit::window::Fullscreen::Borderless(None));
                        screen.window.set_fullscreen(whole);
                    }
                }
                request => self.start(request),
            }
        }
    }
}

/// Writes what the window shows.
fn save_screenshot(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    path: &Path,
) -> Result<(), String> {
    let bytes = readback::texture(device, queue, texture).map_err(|e| e.to_string())?;
    let bgra = matches!(texture.format(), wgpu::TextureFormat::Bgra8Unorm | wgpu::TextureFormat::Bgra8UnormSrgb);
    let rgb: Vec<u8> =
        bytes.chunks_exact(4).flat_map(|p| if bgra { [p[2], p[1], p[0]] } else { [p[0], p[1], p[2]] }).collect();
    bouncelight_scene::image_io::write_png(path, texture.width(), texture.height(), &rgb, &[])
        .map_err(|e| e.to_string())
}
