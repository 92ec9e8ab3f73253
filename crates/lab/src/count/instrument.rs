//! A compute shader that counts what it does: operations, rays, and what it asks of each binding.
//! naga reads it; each straight piece of its code gets a call that adds what the piece holds, its
//! entry points one that hands the sums over (`counted.wgsl`).
//!
//! An operation is one number of an arithmetic, comparison, selection or conversion; integers count
//! like floats, a multiply-add 2, a division or transcendental function 4; addresses, moves and
//! signs are free.

use super::chain::Chain;
use super::reader::{FIRST, NUMBERS, Reader, Sum};
use naga::front::Typifier;
use naga::proc::ResolveContext;
use naga::{
    AddressSpace, Binding, Block, BuiltIn, Expression, Function, FunctionArgument, Handle, Literal, Module, Scalar,
    Span, Statement, Type, TypeInner,
};
use std::collections::HashSet;

/// Group of the sums.
pub const GROUP: usize = 3;
/// A function of each ray.
const RAY: &str = "walk_begin";
/// The number of links.
const LINKS: usize = 2;

/// A shader that counts, and what it counts.
pub struct Counting {
    pub module: Module,
    /// Group, binding of what each number from [`FIRST`] on belongs to. Of buffers it is bytes, of
    /// textures texels.
    pub bindings: Vec<(u32, u32)>,
}

/// The shader `text` with its compute entry points counting; `None` where it has none, names more
/// bindings than there are numbers, or is not understood (the driver's own message then says why).
pub fn counting(text: &str) -> Option<Counting> {
    // Directives stay in front.
    let directive = |l: &&str| ["enable ", "requires ", "diagnostic"].iter().any(|d| l.starts_with(d)) || l.is_empty();
    let head: usize = text.split_inclusive('\n').take_while(|l| directive(&l.trim())).map(str::len).sum();
    let counted = include_str!("counted.wgsl");
    let mut module = naga::front::wgsl::parse_str(&[&text[..head], counted, &text[head..]].concat()).ok()?;
    if !module.entry_points.iter().any(|e| e.stage == naga::ShaderStage::Compute) {
        return None;
    }
    let globals = module.global_variables.iter().filter_map(|(_, v)| Some((v.binding.as_ref()?, v.space)));
    let large = |space| matches!(space, AddressSpace::Storage { .. } | AddressSpace::Handle);
    let globals = globals.filter(|(b, space)| b.group != GROUP as u32 && large(*space));
    let mut bindings: Vec<(u32, u32)> = globals.map(|(b, _)| (b.group, b.binding)).collect();
    bindings.sort_unstable();
    if bindings.len() > NUMBERS - FIRST {
        return None;
    }
    let named = |name: &str| module.functions.iter().find(|(_, f)| f.name.as_deref() == Some(name)).map(|(h, _)| h);
    let calls = Calls { add: named("counted_add")?, meet: named("counted_meet")? };
    let mut reads = HashSet::new();
    let (start, end) = (named("counted_start")?, named("counted_end")?);

    let own = |f: &Function| f.name.as_ref().is_some_and(|n| n.starts_with("counted_"));
    let handles: Vec<_> = module.functions.iter().filter(|(_, f)| !own(f)).map(|(h, _)| h).collect();
    for handle in handles {
        let mut function = std::mem::take(&mut module.functions[handle]);
        let ray = function.name.as_deref() == Some(RAY);
        if count_in(&module, &mut function, calls, (&bindings, &reads), u32::from(ray))? {
            reads.insert(handle);
        }
        module.functions[handle] = function;
    }
    let word = module.types.insert(Type { name: None, inner: TypeInner::Scalar(Scalar::U32) }, Span::UNDEFINED);
    for i in 0..module.entry_points.len() {
        if module.entry_points[i].stage != naga::ShaderStage::Compute {
            continue;
        }
        let mut inner = std::mem::take(&mut module.entry_points[i].function);
        count_in(&module, &mut inner, calls, (&bindings, &reads), 0)?;
        module.entry_points[i].function = around(&mut module, inner, [start, end], word);
    }
    Some(Counting { module, bindings })
}

/// An entry point that calls what was one between `start` and `end`.
fn around(module: &mut Module, mut inner: Function, ends: [Handle<Function>; 2], word: Handle<Type>) -> Function {
    let index = Binding::BuiltIn(BuiltIn::LocalInvocationIndex);
    let mut outer = Function { name: inner.name.clone(), arguments: inner.arguments.clone(), ..Function::default() };
    inner.name = inner.name.map(|n| format!("counted_{n}"));
    inner.arguments.iter_mut().for_each(|a| a.binding = None);
    let count = inner.arguments.len() as u32;
    let place = outer.arguments.iter().position(|a| a.binding.as_ref() == Some(&index));
    let place = place.unwrap_or_else(|| {
        outer.arguments.push(FunctionArgument { name: Some("counted_thread".into()), ty: word, binding: Some(index) });
        outer.arguments.len() - 1
    });
    let inner = module.functions.append(inner, Span::UNDEFINED);
    let mut argument = |i| outer.expressions.append(Expression::FunctionArgument(i), Span::UNDEFINED);
    let arguments: Vec<_> = (0..count).map(&mut argument).collect();
    let thread = arguments.get(place).copied().unwrap_or_else(|| argument(place as u32));
    let call = |function, arguments| Statement::Call { function, arguments, result: None };
    outer.body = Block::from_vec(vec![call(ends[0], vec![thread]), call(inner, arguments), call(ends[1], vec![])]);
    outer.body.push(Statement::Return { value: None }, Span::UNDEFINED);
    outer
}

/// What is called: with each straight piece, and where threads wait for each other.
#[derive(Clone, Copy)]
struct Calls {
    add: Handle<Function>,
    meet: Handle<Function>,
}

/// Puts the calls into a function; whether it reads memory, itself or by functions (those of the
/// second part of `known`) that it calls. `rays` are those that each call of it is.
fn count_in(module: &Module, function: &mut Function, calls: Calls, known: Known<'_>, rays: u32) -> Option<bool> {
    let before = function.expressions.clone();
    let context = ResolveContext::with_locals(module, &function.local_variables, &function.arguments);
    let mut types = Typifier::new();
    for (handle, _) in before.iter() {
        types.grow(handle, &before, &context).ok()?;
    }
    let reader = Reader { module, expressions: &before, types: &types, bindings: known.0 };
    let mut writer = Writer { reader, expressions: &mut function.expressions, calls, chain: Chain::new(known.1) };
    let mut sum = [0; NUMBERS];
    sum[1] = rays;
    function.body = writer.block(std::mem::take(&mut function.body), sum);
    Some(writer.chain.read)
}

/// Bindings, and functions that read memory.
type Known<'a> = (&'a [(u32, u32)], &'a HashSet<Handle<Function>>);

struct Writer<'a> {
    reader: Reader<'a>,
    expressions: &'a mut naga::Arena<Expression>,
    calls: Calls,
    chain: Chain<'a>,
}

impl Writer<'_> {
    /// The block with a call behind each straight piece, the first of which has done `sum` already.
    fn block(&mut self, block: Block, mut sum: Sum) -> Block {
        let mut out = Block::with_capacity(2 * block.len());
        for (mut statement, span) in block.span_into_iter() {
            if let Statement::Call { function, .. } = statement
                && self.chain.calls(function)
            {
                // What follows waits for what it has read.
                self.calls(&mut sum, &mut out);
                self.chain.read = true;
            }
            self.reader.statement(&statement, &mut sum);
            self.chain.statement(&statement, &self.reader);
            let jumps = matches!(
                statement,
                Statement::Break | Statement::Continue | Statement::Return { .. } | Statement::Kill
            );
            match &mut statement {
                Statement::Block(inner) => self.inside(inner, &mut sum, &mut out),
                Statement::If { accept, reject, .. } => {
                    self.inside(accept, &mut sum, &mut out);
                    self.inside(reject, &mut sum, &mut out);
                }
                Statement::Switch { cases, .. } => {
                    cases.iter_mut().for_each(|case| self.inside(&mut case.body, &mut sum, &mut out));
                }
                Statement::Loop { body, continuing, .. } => {
                    self.inside(body, &mut sum, &mut out);
                    self.inside(continuing, &mut sum, &mut out);
                }
                Statement::ControlBarrier(_) | Statement::WorkGroupUniformLoad { .. } => {
                    self.calls(&mut sum, &mut out);
                    let meet = Statement::Call { function: self.calls.meet, arguments: vec![], result: None };
                    out.push(meet, Span::UNDEFINED);
                }
                _ if jumps => self.calls(&mut sum, &mut out),
                _ => {}
            }
            out.push(statement, span);
        }
        // Nothing may stand behind a jump.
        self.calls(&mut sum, &mut out);
        out
    }

    fn inside(&mut self, block: &mut Block, sum: &mut Sum, out: &mut Block) {
        self.calls(sum, out);
        *block = self.block(std::mem::take(block), [0; NUMBERS]);
    }

    /// Adds what has come together.
    fn calls(&mut self, sum: &mut Sum, out: &mut Block) {
        sum[LINKS] += self.chain.end();
        for (number, n) in std::mem::replace(sum, [0; NUMBERS]).into_iter().enumerate().filter(|(_, n)| *n > 0) {
            let arguments = [number as u32, n]
                .map(|v| self.expressions.append(Expression::Literal(Literal::U32(v)), Span::UNDEFINED));
            let call = Statement::Call { function: self.calls.add, arguments: arguments.to_vec(), result: None };
            out.push(call, Span::UNDEFINED);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn validated(text: &str) -> Counting {
        let found = counting(text).expect("understood");
        let all = naga::valid::Capabilities::all();
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), all).validate(&found.module).expect("valid");
        found
    }

    #[test]
    fn every_compute_shader_counts_and_stays_valid() {
        let mut seen = 0;
        let render = bouncelight::render::example_preludes();
        for (name, prelude) in bouncelight::gi::example_preludes().into_iter().chain(render) {
            let text = bouncelight::gpu::shaders::source(name, &prelude);
            if text.contains("@compute") {
                validated(&text);
                seen += 1;
            }
        }
        assert!(seen >= 17, "{seen}");
    }
}
