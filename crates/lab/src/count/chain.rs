//! How many reads of memory in a straight piece of code wait for one another: those that need no
//! other's result are under way together.

use super::reader::Reader;
use naga::{Expression, Function, Handle, Range, Statement};
use std::collections::{HashMap, HashSet};

/// The piece under way.
pub struct Chain<'a> {
    /// Functions that read memory: what follows a call of one waits for it.
    reads: &'a HashSet<Handle<Function>>,
    /// Memory is read at all, in this piece or one before.
    pub read: bool,
    /// Reads one after the other that an expression waits for, where there are any.
    depths: HashMap<Handle<Expression>, u32>,
    /// The same of what a variable holds, by the expression that names it.
    kept: HashMap<Handle<Expression>, u32>,
    longest: u32,
}

impl<'a> Chain<'a> {
    pub fn new(reads: &'a HashSet<Handle<Function>>) -> Self {
        Self { reads, read: false, depths: HashMap::new(), kept: HashMap::new(), longest: 0 }
    }

    /// Whether a function reads memory.
    pub fn calls(&self, function: Handle<Function>) -> bool {
        self.reads.contains(&function)
    }

    /// The longest chain of the piece, which ends: what follows waits for all of it.
    pub fn end(&mut self) -> u32 {
        self.depths.clear();
        self.kept.clear();
        std::mem::take(&mut self.longest)
    }

    pub fn statement(&mut self, statement: &Statement, reader: &Reader<'_>) {
        match *statement {
            Statement::Emit(ref range) => self.emit(range, reader),
            Statement::Store { pointer, value } => {
                let depth = self.depth(value);
                if depth > 0 {
                    let kept = self.kept.entry(root(pointer, reader)).or_default();
                    *kept = depth.max(*kept);
                }
            }
            Statement::Atomic { pointer, value, result, .. } if reader.far(pointer) => {
                let depth = 1 + self.depth(value).max(self.depth(pointer));
                self.read(depth);
                if let Some(result) = result {
                    self.depths.insert(result, depth);
                }
            }
            Statement::Call { ref arguments, result: Some(result), .. } => {
                let depth = arguments.iter().map(|a| self.depth(*a)).max().unwrap_or(0);
                if depth > 0 {
                    self.depths.insert(result, depth);
                }
            }
            _ => {}
        }
    }

    fn emit(&mut self, range: &Range<Expression>, reader: &Reader<'_>) {
        for handle in range.clone() {
            let expression = &reader.expressions[handle];
            let mut depth = 0;
            operands(expression, |e| depth = depth.max(self.depth(e)));
            let far = match *expression {
                Expression::Load { pointer } => {
                    depth = depth.max(self.kept.get(&root(pointer, reader)).copied().unwrap_or(0));
                    reader.far(pointer)
                }
                Expression::ImageLoad { .. } | Expression::ImageSample { .. } => true,
                _ => false,
            };
            if far {
                depth += 1;
                self.read(depth);
            }
            if depth > 0 {
                self.depths.insert(handle, depth);
            }
        }
    }

    fn read(&mut self, depth: u32) {
        self.read = true;
        self.longest = self.longest.max(depth);
    }

    fn depth(&self, e: Handle<Expression>) -> u32 {
        self.depths.get(&e).copied().unwrap_or(0)
    }
}

/// The variable or argument that a pointer points into.
fn root(mut pointer: Handle<Expression>, reader: &Reader<'_>) -> Handle<Expression> {
    while let Expression::Access { base, .. } | Expression::AccessIndex { base, .. } = reader.expressions[pointer] {
        pointer = base;
    }
    pointer
}

/// What an expression is made of.
fn operands(expression: &Expression, mut each: impl FnMut(Handle<Expression>)) {
    use Expression as E;
    match *expression {
        E::Access { base, index } => [base, index].into_iter().for_each(each),
        E::AccessIndex { base: e, .. }
        | E::Splat { value: e, .. }
        | E::Swizzle { vector: e, .. }
        | E::Load { pointer: e }
        | E::Unary { expr: e, .. }
        | E::Derivative { expr: e, .. }
        | E::Relational { argument: e, .. }
        | E::As { expr: e, .. } => each(e),
        E::Compose { ref components, .. } => components.iter().copied().for_each(each),
        E::Binary { left, right, .. } => [left, right].into_iter().for_each(each),
        E::Select { condition, accept, reject } => [condition, accept, reject].into_iter().for_each(each),
        E::Math { arg, arg1, arg2, arg3, .. } => {
            [Some(arg), arg1, arg2, arg3].into_iter().flatten().for_each(each);
        }
        E::ImageLoad { coordinate, array_index, sample, level, .. } => {
            [Some(coordinate), array_index, sample, level].into_iter().flatten().for_each(each);
        }
        E::ImageSample { coordinate, array_index, depth_ref, .. } => {
            [Some(coordinate), array_index, depth_ref].into_iter().flatten().for_each(each);
        }
        _ => {}
    }
}
