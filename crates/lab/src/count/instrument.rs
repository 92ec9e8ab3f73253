//! A compute shader that counts what it does: operations, rays, and what it asks of each binding.
//! naga reads it; each straight piece of its code gets a call that adds what the piece holds, its
//! entry points one that hands the sums over (`counted.wgsl`).
//!
//! An operation is one number of an arithmetic, comparison, selection or conversion; integers count
//! like floats, a multiply-add 2, a division or transcendental function 4; addresses, moves and
//! signs are free.

use super::chain::Chain;
use naga::front::Typifier;
use naga::proc::ResolveContext;
use naga::{
    AddressSpace, BinaryOperator, Binding, Block, BuiltIn, Expression, Function, FunctionArgument, Handle, Literal,
    MathFunction, Module, Scalar, Span, Statement, Type, TypeInner, UnaryOperator,
};
use std::collections::HashSet;

/// Group of the sums.
pub const GROUP: usize = 3;
/// Numbers that `counted.wgsl` keeps of a thread, and the first that belongs to a binding.
pub const NUMBERS: usize = 27;
pub const FIRST: usize = 3;
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

/// Amounts by number.
type Sum = [u32; NUMBERS];

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

/// What expressions and statements do.
pub struct Reader<'a> {
    module: &'a Module,
    pub expressions: &'a naga::Arena<Expression>,
    types: &'a Typifier,
    bindings: &'a [(u32, u32)],
}

impl Reader<'_> {
    fn statement(&self, statement: &Statement, sum: &mut Sum) {
        match *statement {
            Statement::Emit(ref range) => range.clone().for_each(|e| self.expression(e, sum)),
            Statement::Store { pointer, .. } => self.memory(pointer, sum),
            Statement::Atomic { pointer, .. } => {
                sum[0] += 1;
                // Read and written.
                self.memory(pointer, sum);
                self.memory(pointer, sum);
            }
            Statement::ImageStore { image, .. } => self.texels(image, 1, sum),
            _ => {}
        }
    }

    fn expression(&self, handle: Handle<Expression>, sum: &mut Sum) {
        let size = |e| components(self.inner(e));
        sum[0] += match self.expressions[handle] {
            Expression::Load { pointer } => {
                self.memory(pointer, sum);
                0
            }
            Expression::ImageLoad { image, .. } => {
                self.texels(image, 1, sum);
                0
            }
            // Neighbours that a filter takes, too, are others' own.
            Expression::ImageSample { image, gather, .. } => {
                self.texels(image, if gather.is_some() { 4 } else { 1 }, sum);
                0
            }
            Expression::Unary { op, expr } => {
                if op == UnaryOperator::Negate {
                    0
                } else {
                    size(expr)
                }
            }
            Expression::Binary { op, left, right } => match (op, self.inner(left), self.inner(right)) {
                (BinaryOperator::Divide | BinaryOperator::Modulo, ..) => 4 * size(handle),
                // Products of matrices: as many multiply-adds as rows times columns of the sum.
                (BinaryOperator::Multiply, &TypeInner::Matrix { columns, .. }, other)
                    if !matches!(other, TypeInner::Scalar(_)) =>
                {
                    2 * columns as u32 * size(handle)
                }
                (BinaryOperator::Multiply, TypeInner::Vector { size: of, .. }, TypeInner::Matrix { .. }) => {
                    2 * *of as u32 * size(handle)
                }
                _ => size(left).max(size(right)),
            },
            Expression::Select { .. } | Expression::Derivative { .. } => size(handle),
            Expression::Relational { argument, .. } => size(argument),
            Expression::As { convert: Some(_), .. } => size(handle),
            Expression::Math { fun, arg, .. } => math(fun, size(arg), size(handle)),
            _ => 0,
        };
    }

    /// Bytes of what a pointer points to, where that lies in a bound buffer.
    fn memory(&self, pointer: Handle<Expression>, sum: &mut Sum) {
        let Some(number) = self.number(pointer, |space| matches!(space, AddressSpace::Storage { .. })) else { return };
        let bytes = match *self.inner(pointer) {
            TypeInner::Pointer { base, .. } => self.module.types[base].inner.try_size(self.module.to_ctx()),
            TypeInner::ValuePointer { size, scalar, .. } => {
                Some(size.map_or(1, |s| s as u32) * u32::from(scalar.width))
            }
            _ => None,
        };
        sum[number] += bytes.unwrap_or(0);
    }

    fn texels(&self, image: Handle<Expression>, n: u32, sum: &mut Sum) {
        if let Some(number) = self.number(image, |space| space == AddressSpace::Handle) {
            sum[number] += n;
        }
    }

    /// The number of the binding that a pointer or texture comes from.
    fn number(&self, mut at: Handle<Expression>, counts: impl Fn(AddressSpace) -> bool) -> Option<usize> {
        loop {
            match self.expressions[at] {
                Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => at = base,
                Expression::GlobalVariable(variable) => {
                    let variable = &self.module.global_variables[variable];
                    let binding = variable.binding.as_ref().filter(|_| counts(variable.space))?;
                    let at = self.bindings.iter().position(|b| *b == (binding.group, binding.binding))?;
                    return Some(FIRST + at);
                }
                _ => return None,
            }
        }
    }

    /// Whether a pointer or texture is a bound one's, which a read of takes long.
    pub fn far(&self, at: Handle<Expression>) -> bool {
        self.number(at, |space| matches!(space, AddressSpace::Storage { .. } | AddressSpace::Handle)).is_some()
    }

    fn inner(&self, e: Handle<Expression>) -> &TypeInner {
        self.types.get(e, &self.module.types)
    }
}

fn components(inner: &TypeInner) -> u32 {
    match *inner {
        TypeInner::Vector { size, .. } => size as u32,
        TypeInner::Matrix { columns, rows, .. } => columns as u32 * rows as u32,
        _ => 1,
    }
}

/// Operations of a function of `n` components that makes `made`.
fn math(fun: MathFunction, n: u32, made: u32) -> u32 {
    use MathFunction as M;
    match fun {
        // A modifier of what reads it.
        M::Abs | M::Saturate => 0,
        M::Fma | M::Clamp => 2 * n,
        M::Mix => 3 * n,
        M::Dot => 2 * n - 1,
        M::Cross => 9,
        M::Length => 2 * n + 3,
        M::Distance => 3 * n + 3,
        M::Normalize => 3 * n + 3,
        M::Reflect => 4 * n,
        M::FaceForward => 3 * n,
        M::SmoothStep => 10 * n,
        M::Pow | M::Atan2 => 8 * n,
        M::Cos
        | M::Sin
        | M::Tan
        | M::Cosh
        | M::Sinh
        | M::Tanh
        | M::Acos
        | M::Asin
        | M::Atan
        | M::Asinh
        | M::Acosh
        | M::Atanh
        | M::Exp
        | M::Exp2
        | M::Log
        | M::Log2
        | M::Sqrt
        | M::InverseSqrt => 4 * n,
        M::Outer | M::Determinant | M::Inverse | M::Transpose => made,
        _ => n.max(made),
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
        for (name, prelude) in bouncelight::gi::example_preludes() {
            let text = bouncelight::gpu::shaders::source(name, &prelude);
            if text.contains("@compute") {
                validated(&text);
                seen += 1;
            }
        }
        assert!(seen >= 17, "{seen}");
    }
}
