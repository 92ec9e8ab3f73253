//! Where tensors live in the arena: which share memory because one overwrites the other in place or
//! is a slice of its channels, and the offsets of all that do not.

use super::{ALIGN, Kind, Plan};
use std::cmp::Reverse;

/// A tensor that lives inside another: which one, and at which vector of its pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inside {
    pub tensor: usize,
    pub slice: u32,
}

/// Lets steps overwrite what they read for the last time, where each thread reads just the element
/// that it then writes. The older tensor moves into the younger.
pub(super) fn overwrite(plan: &Plan, inside: &mut [Option<Inside>]) {
    for (i, step) in plan.steps.iter().enumerate() {
        let mut candidates = Vec::new();
        if let Some(skip) = step.skip.filter(|skip| *skip != step.input) {
            candidates.push(skip);
        }
        if matches!(step.kind, Kind::Copy | Kind::Scale { .. }) && step.skip != Some(step.input) {
            candidates.push(step.input);
        }
        let inside_of = |m: usize, t: usize| {
            let mut at = m;
            while let Some(outer) = inside[at].filter(|_| at != t) {
                at = outer.tensor;
            }
            at == t
        };
        let free = |t: &usize| {
            // A slice of a concatenation may be read after the whole for the last time.
            let others = (0..inside.len()).filter(|m| m != t && inside_of(*m, *t));
            // The caller writes the input densely, so it cannot lie inside something wider.
            *t != 0
                && *t != plan.output
                && plan.tensors[*t].last == i + 1
                && inside[*t].is_none()
                && plan.tensors[*t].full == plan.tensors[step.output].full
                && others.into_iter().all(|m| plan.tensors[m].last <= i)
        };
        if let Some(older) = candidates.into_iter().find(free) {
            inside[older] = Some(Inside { tensor: step.output, slice: 0 });
        }
    }
}

/// Gives every tensor its root, pitch and offset. Greedy by size: the largest root first, each at
/// the lowest offset that is free during its life.
pub(super) fn place(plan: &mut Plan, inside: &[Option<Inside>]) {
    for t in 0..plan.tensors.len() {
        let (mut root, mut slice) = (t, 0);
        while let Some(outer) = inside[root] {
            slice += outer.slice;
            root = outer.tensor;
        }
        let pitch = plan.tensors[root].shape.vectors();
        let tensor = &mut plan.tensors[t];
        (tensor.root, tensor.slice, tensor.pitch) = (root, slice, pitch);
    }
    let widest = plan.tensors.iter().map(|t| t.shape.vectors()).max().unwrap_or(1);
    plan.zero_bytes = (u64::from(widest) * 16).next_multiple_of(ALIGN);
    // Root, bytes, first and last time.
    let mut roots: Vec<(usize, u64, usize, usize)> = Vec::new();
    for t in (0..plan.tensors.len()).filter(|t| plan.tensors[*t].root == *t) {
        let members = plan.tensors.iter().filter(|m| m.root == t);
        let (first, last) = members.fold((usize::MAX, 0), |(a, b), m| (a.min(m.first), b.max(m.last)));
        roots.push((t, plan.tensors[t].bytes().next_multiple_of(ALIGN), first, last));
    }
    roots.sort_by_key(|(t, bytes, ..)| (Reverse(*bytes), *t));
    // Begin, end, first and last time.
    let mut placed: Vec<(u64, u64, usize, usize)> = Vec::new();
    for (root, bytes, first, last) in roots {
        let mut busy: Vec<_> = placed.iter().filter(|p| p.2 <= last && first <= p.3).map(|p| (p.0, p.1)).collect();
        busy.sort_unstable();
        let mut offset = plan.zero_bytes;
        for (from, to) in busy {
            if offset + bytes <= from {
                break;
            }
            offset = offset.max(to);
        }
        placed.push((offset, offset + bytes, first, last));
        for tensor in plan.tensors.iter_mut().filter(|t| t.root == root) {
            tensor.offset = offset + u64::from(tensor.slice) * tensor.vector_bytes();
        }
    }
    plan.arena_bytes = placed.iter().map(|p| p.1).max().unwrap_or(plan.zero_bytes);
}
