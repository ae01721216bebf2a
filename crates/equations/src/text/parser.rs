//! Recursive-descent parser for expressions, with the grammar
//!
//! ```text
//! expression = product { ("+" | "-") product } ;
//! product    = unary { ("*" | "/") unary } ;
//! unary      = [ "-" | "+" ] power ;
//! power      = atom [ "^" unary ] ;                       -x^2 = -(x^2); a^b^c = a^(b^c)
//! atom       = number | name | name "(" argument { "," argument } ")" | "(" expression ")" ;
//! argument   = expression [ ("<" | "<=" | ">" | ">=") expression ] ;
//! ```

use super::function::{SPECIAL, instead_of};
use super::lexer::{Lexer, Token, shortened};
use super::{Comparison, Function, Kind, Problem, Symbol, Tree, TreeNode};
use crate::limits::{MAX_EXPRESSION_BYTES, MAX_EXPRESSION_DEPTH};
use std::ops::Range;

/// Resolves the names that an expression uses.
pub trait Scope {
    /// Returns the quantity that a name refers to.
    ///
    /// # Errors
    /// The problem with the name, for example [`Problem::UnknownName`].
    fn symbol(&self, name: &str) -> Result<Symbol, Problem>;
    /// Returns the index of the table with this name.
    ///
    /// # Errors
    /// [`Problem::UnknownTable`].
    fn table(&self, name: &str) -> Result<usize, Problem>;
    /// Returns the index of the joint of the model's robot with this name.
    ///
    /// # Errors
    /// [`Problem::UnknownJoint`].
    fn joint(&self, name: &str) -> Result<usize, Problem> {
        Err(Problem::UnknownJoint { name: crate::text::lexer::shortened(name), nearest: None })
    }
    /// Whether `slope` is allowed in the expression.
    fn allows_slope(&self) -> bool {
        false
    }
}

/// A problem in an expression, and the bytes of the text that it concerns.
type Failure = (Problem, Range<usize>);

/// Parses the text of an expression to a tree.
///
/// With `is_condition` it is a comparison of two expressions, stored as an `if` that returns 1 or 0.
///
/// # Errors
/// The first problem, with the bytes of the text that it concerns.
pub fn parse(text: &str, scope: &dyn Scope, is_condition: bool) -> Result<Tree, Failure> {
    if text.len() > MAX_EXPRESSION_BYTES {
        return Err((Problem::TooLong { bytes: text.len() }, 0..0));
    }
    let mut lexer = Lexer::new(text);
    let (token, span) = lexer.next()?;
    if token == Token::End {
        return Err((Problem::Empty, 0..0));
    }
    let mut parser = Parser { text, lexer, token, span, scope, nodes: Vec::new(), depth: 0 };
    let left = parser.expression()?;
    if is_condition {
        let comparison =
            parser.comparison()?.ok_or_else(|| parser.problem_here(Problem::ConditionMissing))?;
        let right = parser.expression()?;
        let then = parser.push(Kind::Number(1.0), 0..0);
        let otherwise = parser.push(Kind::Number(0.0), 0..0);
        parser.push(Kind::If { comparison, left, right, then, otherwise }, 0..text.len());
    }
    match parser.token {
        Token::End => Ok(Tree { text: text.to_owned(), nodes: parser.nodes }),
        Token::Sign(b')') => Err(parser.problem_here(Problem::UnmatchedParenthesis)),
        Token::Sign(b'<' | b'>') | Token::LessOrEqual | Token::GreaterOrEqual => {
            Err(parser.problem_here(Problem::ComparisonOutside))
        }
        _ => {
            let found = parser.found();
            Err(parser.problem_here(Problem::ExpectedOperator { found }))
        }
    }
}

/// State of the parser: the present token with its byte range, and the nodes so far.
struct Parser<'t, 's> {
    text: &'t str,
    lexer: Lexer<'t>,
    token: Token<'t>,
    span: Range<usize>,
    scope: &'s dyn Scope,
    nodes: Vec<TreeNode>,
    depth: usize,
}

impl Parser<'_, '_> {
    /// A problem at the present token, with the bytes of that token.
    fn problem_here(&self, problem: Problem) -> Failure {
        (problem, self.span.clone())
    }

    /// Describes the present token for a message.
    fn found(&self) -> String {
        match self.token {
            Token::End => "the end of the expression".into(),
            _ => format!("`{}`", shortened(self.text.get(self.span.clone()).unwrap_or(""))),
        }
    }

    fn advance(&mut self) -> Result<(), Failure> {
        (self.token, self.span) = self.lexer.next()?;
        Ok(())
    }

    /// Skips the present token if it is the sign `sign`; returns whether it was.
    fn take(&mut self, sign: u8) -> Result<bool, Failure> {
        let is_present = self.token == Token::Sign(sign);
        if is_present {
            self.advance()?;
        }
        Ok(is_present)
    }

    fn push(&mut self, kind: Kind, span: Range<usize>) -> usize {
        self.nodes.push(TreeNode { kind, span });
        self.nodes.len() - 1
    }

    /// Range of bytes from the start of node `a` to the end of node `b`.
    fn across(&self, a: usize, b: usize) -> Range<usize> {
        self.nodes[a].span.start..self.nodes[b].span.end
    }

    /// Runs the parsing function `inner` one nesting level deeper.
    ///
    /// The limit keeps the recursion from exhausting the stack.
    fn deeper<R>(&mut self, inner: impl FnOnce(&mut Self) -> Result<R, Failure>) -> Result<R, Failure> {
        if self.depth >= MAX_EXPRESSION_DEPTH {
            return Err(self.problem_here(Problem::TooDeep));
        }
        self.depth += 1;
        let result = inner(self);
        self.depth -= 1;
        result
    }

    fn expression(&mut self) -> Result<usize, Failure> {
        self.deeper(|p| {
            let mut left = p.product()?;
            loop {
                let adds = p.token == Token::Sign(b'+');
                if !adds && p.token != Token::Sign(b'-') {
                    return Ok(left);
                }
                p.advance()?;
                let right = p.product()?;
                let kind = if adds { Kind::Add(left, right) } else { Kind::Subtract(left, right) };
                left = p.push(kind, p.across(left, right));
            }
        })
    }

    fn product(&mut self) -> Result<usize, Failure> {
        let mut left = self.unary()?;
        loop {
            let multiplies = self.token == Token::Sign(b'*');
            if !multiplies && self.token != Token::Sign(b'/') {
                return Ok(left);
            }
            self.advance()?;
            let right = self.unary()?;
            let kind = if multiplies { Kind::Multiply(left, right) } else { Kind::Divide(left, right) };
            left = self.push(kind, self.across(left, right));
        }
    }

    fn unary(&mut self) -> Result<usize, Failure> {
        let begin = self.span.start;
        if self.take(b'-')? {
            let inner = self.power()?;
            let end = self.nodes[inner].span.end;
            return Ok(self.push(Kind::Negate(inner), begin..end));
        }
        self.take(b'+')?;
        self.power()
    }

    fn power(&mut self) -> Result<usize, Failure> {
        let base = self.atom()?;
        if !self.take(b'^')? {
            return Ok(base);
        }
        let exponent = self.deeper(Self::unary)?;
        let span = self.across(base, exponent);
        Ok(self.push(Kind::Power(base, exponent), span))
    }

    fn atom(&mut self) -> Result<usize, Failure> {
        let span = self.span.clone();
        match self.token {
            Token::Number(value) => {
                self.advance()?;
                Ok(self.push(Kind::Number(value), span))
            }
            Token::Name(name) => {
                self.advance()?;
                if self.token == Token::Sign(b'(') { self.call(name, span) } else { self.name(name, span) }
            }
            Token::Sign(b'(') => {
                self.advance()?;
                let inner = self.expression()?;
                let end = self.close(&span)?;
                self.nodes[inner].span = span.start..end;
                Ok(inner)
            }
            _ => {
                let found = self.found();
                Err(self.problem_here(Problem::ExpectedValue { found }))
            }
        }
    }

    /// Skips the `)` that closes the `(` at `open`; returns the position of the byte after it.
    fn close(&mut self, open: &Range<usize>) -> Result<usize, Failure> {
        let end = self.span.end;
        match self.token {
            Token::Sign(b')') => {
                self.advance()?;
                Ok(end)
            }
            Token::End | Token::Sign(b',') => {
                let column = 1 + self.text.get(..open.start).unwrap_or("").chars().count();
                Err((Problem::UnclosedParenthesis { column }, open.clone()))
            }
            Token::Sign(b'<' | b'>') | Token::LessOrEqual | Token::GreaterOrEqual => {
                Err(self.problem_here(Problem::ComparisonOutside))
            }
            _ => {
                let found = self.found();
                Err(self.problem_here(Problem::ExpectedOperator { found }))
            }
        }
    }

    fn name(&mut self, name: &str, span: Range<usize>) -> Result<usize, Failure> {
        if name == "pi" {
            return Ok(self.push(Kind::Number(std::f64::consts::PI), span));
        }
        if name == "e" {
            let why = "write exp(1) for the base of natural logarithms";
            return Err((Problem::NotHere { name: name.into(), why }, span));
        }
        if Function::named(name).is_some() || SPECIAL.contains(&name) {
            return Err((Problem::FunctionWithoutArguments { name: name.into() }, span));
        }
        match self.scope.symbol(name) {
            Ok(symbol) => Ok(self.push(Kind::Symbol(symbol), span)),
            Err(problem) => Err((problem, span)),
        }
    }

    fn call(&mut self, name: &str, span: Range<usize>) -> Result<usize, Failure> {
        match name {
            "if" => return self.condition(span),
            "table" | "slope" => return self.named_call(name, span),
            "inverse_dynamics" => return self.joint_call(name, span, Symbol::JointTorque),
            "forward_dynamics" => return self.joint_call(name, span, Symbol::JointAcceleration),
            "external_rate" => return self.rate_call(span),
            _ => {}
        }
        let Some(function) = Function::named(name) else {
            let known = self.scope.symbol(name).is_ok() || name == "pi";
            let remedy = instead_of(name).map(|text| format!("; write {text}"));
            let nearest = crate::nearest::nearest(name, Function::names());
            let remedy = remedy.unwrap_or_else(|| super::problem::suggest(&nearest));
            let name = shortened(name);
            let problem = if known {
                Problem::NotAFunction { name }
            } else {
                Problem::UnknownFunction { name, remedy }
            };
            return Err((problem, span));
        };
        let open = self.span.clone();
        self.advance()?;
        let mut arguments = Vec::new();
        if self.token != Token::Sign(b')') {
            arguments.push(self.expression()?);
            while self.take(b',')? {
                arguments.push(self.expression()?);
            }
        }
        let end = self.close(&open)?;
        let (takes, given) = (function.arity(), arguments.len());
        if takes != given {
            return Err((Problem::Arity { function: function.name(), takes, given }, span.start..end));
        }
        Ok(self.push(Kind::Call(function, arguments), span.start..end))
    }

    fn comparison(&mut self) -> Result<Option<Comparison>, Failure> {
        let found = match self.token {
            Token::Sign(b'<') => Comparison::Less,
            Token::Sign(b'>') => Comparison::Greater,
            Token::LessOrEqual => Comparison::LessOrEqual,
            Token::GreaterOrEqual => Comparison::GreaterOrEqual,
            _ => return Ok(None),
        };
        self.advance()?;
        Ok(Some(found))
    }

    /// Parses `if(a < b, x, y)` after its name.
    fn condition(&mut self, span: Range<usize>) -> Result<usize, Failure> {
        let open = self.span.clone();
        self.advance()?;
        let left = self.expression()?;
        let comparison = self.comparison()?.ok_or_else(|| (Problem::ConditionMissing, span.clone()))?;
        let mut branches = vec![self.expression()?];
        while self.take(b',')? {
            branches.push(self.expression()?);
        }
        let end = self.close(&open)?;
        let [right, then, otherwise] = branches[..] else {
            let problem = Problem::Arity { function: "if", takes: 3, given: branches.len() };
            return Err((problem, span.start..end));
        };
        Ok(self.push(Kind::If { comparison, left, right, then, otherwise }, span.start..end))
    }

    /// Parses `inverse_dynamics(JOINT)` and `forward_dynamics(JOINT)` after their names.
    fn joint_call(
        &mut self,
        function: &str,
        span: Range<usize>,
        symbol: fn(usize) -> Symbol,
    ) -> Result<usize, Failure> {
        let function = SPECIAL.into_iter().find(|name| *name == function).unwrap_or_default();
        let open = self.span.clone();
        self.advance()?;
        let Token::Name(name) = self.token else {
            return Err(self.problem_here(Problem::NameMissing { function, expected: "a joint" }));
        };
        let name_span = self.span.clone();
        self.advance()?;
        let joint = self.scope.joint(name).map_err(|problem| (problem, name_span))?;
        let end = self.close(&open)?;
        Ok(self.push(Kind::Symbol(symbol(joint)), span.start..end))
    }

    /// Parses `external_rate(STATE)` after its name.
    fn rate_call(&mut self, span: Range<usize>) -> Result<usize, Failure> {
        let missing = Problem::NameMissing { function: "external_rate", expected: "a state" };
        let open = self.span.clone();
        self.advance()?;
        let Token::Name(name) = self.token else { return Err(self.problem_here(missing)) };
        let name_span = self.span.clone();
        self.advance()?;
        let end = self.close(&open)?;
        match self.scope.symbol(name) {
            Ok(Symbol::State(state)) => {
                Ok(self.push(Kind::Symbol(Symbol::ExternalRate(state)), span.start..end))
            }
            Ok(_) => Err((missing, name_span)),
            Err(problem) => Err((problem, name_span)),
        }
    }

    /// Parses `table(NAME, z)` and `slope(OUTPUT)` after their names.
    ///
    /// The first argument is a name, not a value.
    fn named_call(&mut self, function: &str, span: Range<usize>) -> Result<usize, Failure> {
        let is_table = function == "table";
        let (function, expected) = if is_table { ("table", "a table") } else { ("slope", "an output") };
        if !is_table && !self.scope.allows_slope() {
            return Err((Problem::SlopeOutsideStart, span));
        }
        let open = self.span.clone();
        self.advance()?;
        let Token::Name(name) = self.token else {
            return Err(self.problem_here(Problem::NameMissing { function, expected }));
        };
        let name_span = self.span.clone();
        self.advance()?;
        if !is_table {
            let end = self.close(&open)?;
            return match self.scope.symbol(name) {
                Ok(Symbol::Output(output)) => Ok(self.push(Kind::Slope { output }, span.start..end)),
                Ok(_) => Err((Problem::NameMissing { function, expected }, name_span)),
                Err(problem) => Err((problem, name_span)),
            };
        }
        let table = self.scope.table(name).map_err(|problem| (problem, name_span))?;
        let mut arguments = Vec::new();
        while self.take(b',')? {
            arguments.push(self.expression()?);
        }
        let end = self.close(&open)?;
        let [at] = arguments[..] else {
            let problem = Problem::Arity { function, takes: 2, given: 1 + arguments.len() };
            return Err((problem, span.start..end));
        };
        Ok(self.push(Kind::Table { table, at }, span.start..end))
    }
}
