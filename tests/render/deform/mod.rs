//! What moves: skins, morph targets, lights and cameras of files; drawn, traced and played.

mod files;
mod light;
mod morphs;
mod motion;
mod rays;
