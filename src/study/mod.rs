//! What is measured over methods and scenes.
