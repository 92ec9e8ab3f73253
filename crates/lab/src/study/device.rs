//! What was measured on, as records name it.

use bouncelight::gpu::Gpu;
use serde::{Deserialize, Serialize};

/// A device.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names say it")]
pub struct Device {
    pub adapter: String,
    pub backend: String,
    pub driver: String,
    pub software: bool,
}

impl Device {
    /// Of an opened device.
    pub fn of(gpu: &Gpu) -> Self {
        Self {
            adapter: gpu.info.name.clone(),
            backend: format!("{:?}", gpu.info.backend).to_lowercase(),
            driver: format!("{} {}", gpu.info.driver, gpu.info.driver_info).trim().into(),
            software: gpu.is_software(),
        }
    }

    /// In words, with what a reader must know.
    pub fn sentence(&self) -> String {
        let kind = if self.software { "a CPU driver, no GPU" } else { "GPU" };
        format!("{} ({kind}; {}, {})", self.adapter, self.backend, self.driver)
    }
}
