//! Bind groups remembered by the identity of the texture views in them, so that a host that hands
//! over the same views every frame (or alternates between a few sets) makes each group once.

/// A few bind groups; the oldest goes when a new one comes. Holding a view keeps its texture alive,
/// so `clear` is called whenever the size changes.
pub(crate) struct ViewCache<const N: usize> {
    entries: Vec<([wgpu::TextureView; N], wgpu::BindGroup)>,
    next: usize,
    made: u64,
}

/// Enough for double and triple buffering.
const CAPACITY: usize = 4;

impl<const N: usize> ViewCache<N> {
    pub(crate) fn new() -> Self {
        Self { entries: Vec::with_capacity(CAPACITY), next: 0, made: 0 }
    }

    /// The group of these views, remembered or made by `make`.
    pub(crate) fn get<E>(
        &mut self,
        views: [&wgpu::TextureView; N],
        make: impl FnOnce() -> Result<wgpu::BindGroup, E>,
    ) -> Result<wgpu::BindGroup, E> {
        let same = |kept: &[wgpu::TextureView; N]| kept.iter().zip(views).all(|(a, b)| a == b);
        if let Some((_, group)) = self.entries.iter().find(|(kept, _)| same(kept)) {
            return Ok(group.clone());
        }
        let group = make()?;
        self.made += 1;
        let entry = (views.map(Clone::clone), group.clone());
        if self.entries.len() < CAPACITY {
            self.entries.push(entry);
        } else {
            self.entries[self.next] = entry;
            self.next = (self.next + 1) % CAPACITY;
        }
        Ok(group)
    }

    /// Forgets all groups and lets go of their textures.
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
        self.next = 0;
    }

    /// How many groups were ever made.
    pub(crate) fn made(&self) -> u64 {
        self.made
    }
}
