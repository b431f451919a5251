//! Order of the exchange in initialisation mode.
//!
//! The graph's nodes are variables: the two ends of every connection, and what lies between them inside a unit. An edge
//! leads from a connection's source to its target, and inside a unit from an input to each output whose initial value is
//! declared to depend on it. A connection's *level* is the longest chain of connections that must be served before its
//! source may be read; connections of one level form a stage, in which all sources are read before any target is set. So
//! a unit is visited as often as its variables need, and the units of one stage can work side by side.
//!
//! Within a level, connections into parameters come first, as a stage of their own: a unit may do late work (settle a bed)
//! at the first get of a value, after which it takes no parameter any more.
//!
//! Where a file lists no dependencies for an output the standard says "assume all". A loop that closes only through such an
//! assumption is cut there, with a note (many exporters leave the list out, and their units would couple to nothing); a loop of declared
//! dependencies is a fault that names its path.

use std::collections::HashMap;

use crate::check::plan::{ArrayConnection, Component, Connection, Fmu, InitialStage};
use crate::fault::{FaultKind, Faults, Place};
use crate::model_description::{Causality, Dependencies, Initial, Item, ModelDescription};

/// Loops of assumed dependencies that are cut one by one, each at the cost of a walk over the graph.
const MOST_SINGLE_CUTS: usize = 100;

/// A node: a variable of a component, or the "all inputs" hub of a component for assumed dependencies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Node {
    Variable(usize, Item),
    Hub(usize),
}

/// An edge's target, and the connection it stands for (scalars first, then arrays), if it is one.
#[derive(Clone, Copy, Debug)]
struct Edge {
    to: usize,
    connection: Option<usize>,
}

#[derive(Default)]
struct Graph {
    nodes: Vec<Node>,
    index: HashMap<Node, usize>,
    edges: Vec<Vec<Edge>>,
    incoming: Vec<usize>,
}

impl Graph {
    fn node(&mut self, node: Node) -> usize {
        *self.index.entry(node).or_insert_with(|| {
            self.nodes.push(node);
            self.edges.push(Vec::new());
            self.incoming.push(0);
            self.nodes.len() - 1
        })
    }

    fn edge(&mut self, from: usize, to: usize, connection: Option<usize>) {
        self.edges[from].push(Edge { to, connection });
        self.incoming[to] += 1;
    }
}

/// The stages for these connections. A loop goes into `faults` and leaves the stages incomplete.
///
/// Cost: linear in connections and declared dependencies.
pub fn stages(
    fmus: &[Fmu],
    components: &[Component],
    connections: &[Connection],
    arrays: &[ArrayConnection],
    place: &Place,
    faults: &mut Faults,
) -> Vec<InitialStage> {
    let model = |component: usize| -> &ModelDescription { &fmus[components[component].fmu].model };
    let mut graph = Graph::default();
    let mut inputs: Vec<Vec<usize>> = vec![Vec::new(); components.len()];
    let mut outputs: Vec<(usize, usize, Item)> = Vec::new();

    let ends = connections
        .iter()
        .map(|c| ((c.from.component, Item::Scalar(c.from.variable)), (c.to.component, Item::Scalar(c.to.variable))))
        .chain(
            arrays
                .iter()
                .map(|c| ((c.from.component, Item::Array(c.from.array)), (c.to.component, Item::Array(c.to.array)))),
        );
    for (connection, (from, to)) in ends.enumerate() {
        let known = graph.nodes.len();
        let a = graph.node(Node::Variable(from.0, from.1));
        if a == known {
            outputs.push((a, from.0, from.1));
        }
        let b = graph.node(Node::Variable(to.0, to.1));
        inputs[to.0].push(b);
        graph.edge(a, b, Some(connection));
    }
    for (node, component, item) in outputs {
        match initial_dependencies(model(component), item) {
            Depends::On(items) => {
                for item in items {
                    // Only what is connected can hold the value back.
                    if let Some(&known) = graph.index.get(&Node::Variable(component, item)) {
                        graph.edge(known, node, None);
                    }
                }
            }
            Depends::OnAll => {
                let known = graph.nodes.len();
                let hub = graph.node(Node::Hub(component));
                if hub == known {
                    for &input in &inputs[component] {
                        graph.edge(input, hub, None);
                    }
                }
                graph.edge(hub, node, None);
            }
        }
    }
    let levels = levels(&mut graph, components, &model, place, faults);

    // Level of a connection = level of its source; parameters before the rest.
    let mut stages: Vec<InitialStage> = Vec::new();
    let mut put = |level: usize, parameter: bool, scalar: bool, index: usize| {
        let stage = 2 * level + usize::from(!parameter);
        if stages.len() <= stage {
            stages.resize_with(stage + 1, InitialStage::default);
        }
        let list = if scalar { &mut stages[stage].connections } else { &mut stages[stage].arrays };
        list.push(index);
    };
    for (index, c) in connections.iter().enumerate() {
        let Some(level) = levels[graph.index[&Node::Variable(c.from.component, Item::Scalar(c.from.variable))]] else {
            continue;
        };
        let parameter = model(c.to.component).variables[c.to.variable].causality == Causality::Parameter;
        put(level, parameter, true, index);
    }
    for (index, c) in arrays.iter().enumerate() {
        if let Some(level) = levels[graph.index[&Node::Variable(c.from.component, Item::Array(c.from.array))]] {
            put(level, false, false, index);
        }
    }
    stages.retain(|stage| !stage.connections.is_empty() || !stage.arrays.is_empty());
    stages
}

enum Depends<'m> {
    On(Box<dyn Iterator<Item = Item> + 'm>),
    OnAll,
}

fn initial_dependencies(model: &ModelDescription, item: Item) -> Depends<'_> {
    match item {
        Item::Array(index) => Depends::On(Box::new(model.arrays[index].initial_dependencies.iter().copied())),
        Item::Scalar(index) => {
            // A start value that is exact depends on nothing.
            if model.variables[index].initial == Some(Initial::Exact) {
                return Depends::On(Box::new(std::iter::empty()));
            }
            match model.initial_unknowns.get(&index).or_else(|| model.outputs.get(&index)) {
                Some(Dependencies::Listed(list)) => {
                    let arrays = model.array_dependencies.get(&index).into_iter().flatten().copied();
                    Depends::On(Box::new(list.iter().map(|&i| Item::Scalar(i)).chain(arrays)))
                }
                Some(Dependencies::Assumed) | None => Depends::OnAll,
            }
        }
    }
}

/// Longest chain of connections before each node; `None` for nodes in or behind a true loop.
fn levels<'m>(
    graph: &mut Graph,
    components: &[Component],
    model: &dyn Fn(usize) -> &'m ModelDescription,
    place: &Place,
    faults: &mut Faults,
) -> Vec<Option<usize>> {
    let count = graph.nodes.len();
    let mut level = vec![0_usize; count];
    let mut done = vec![false; count];
    let mut ready: Vec<usize> = (0..count).filter(|&n| graph.incoming[n] == 0).collect();
    let mut cut = vec![false; count];
    let mut cuts = 0;
    loop {
        while let Some(node) = ready.pop() {
            done[node] = true;
            for k in 0..graph.edges[node].len() {
                let edge = graph.edges[node][k];
                level[edge.to] = level[edge.to].max(level[node] + usize::from(edge.connection.is_some()));
                graph.incoming[edge.to] -= 1;
                if graph.incoming[edge.to] == 0 && !done[edge.to] {
                    ready.push(edge.to);
                }
            }
        }
        // Stuck: cut the assumed dependencies of one component that lies on a loop, and go on.
        let on_loop = nodes_on_loops(graph, &done);
        let hubs = (0..count).filter(|&n| !done[n] && on_loop[n] && matches!(graph.nodes[n], Node::Hub(_)));
        // One at a time cuts no more than needed; in a system with many, all at once keeps the cost linear.
        let most = if cuts < MOST_SINGLE_CUTS { 1 } else { count };
        let hubs: Vec<usize> = hubs.take(most).collect();
        if hubs.is_empty() {
            break;
        }
        cuts += 1;
        for &hub in &hubs {
            if let Node::Hub(component) = graph.nodes[hub] {
                faults.note(
                    place,
                    format!("Component \"{}\"", components[component].name),
                    "its model lists no initial dependencies and lies on a loop of connections: its first outputs are read before all of its inputs are set",
                );
            }
            cut[hub] = true;
        }
        for edges in &mut graph.edges {
            edges.retain(|edge| !cut[edge.to]);
        }
        for hub in hubs {
            graph.incoming[hub] = 0;
            ready.push(hub);
        }
    }
    if done.iter().any(|done| !done) {
        let path = loop_path(graph, &done);
        let name = |n: &usize| match graph.nodes[*n] {
            Node::Variable(component, item) => {
                Some(format!("{}.{}", components[component].name, model(component).name_of(item)))
            }
            Node::Hub(_) => None,
        };
        faults.add(place, "Connections", FaultKind::Loop { path: path.iter().filter_map(name).collect() });
    }
    (0..count).map(|n| done[n].then_some(level[n])).collect()
}

/// Which of the nodes not done lie on a loop rather than behind one: those left after also peeling from the far end.
fn nodes_on_loops(graph: &Graph, done: &[bool]) -> Vec<bool> {
    let count = graph.nodes.len();
    let mut backwards: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut outgoing = vec![0_usize; count];
    for from in (0..count).filter(|&n| !done[n]) {
        for edge in graph.edges[from].iter().filter(|e| !done[e.to]) {
            backwards[edge.to].push(from);
            outgoing[from] += 1;
        }
    }
    let mut left: Vec<bool> = done.iter().map(|done| !done).collect();
    let mut ends: Vec<usize> = (0..count).filter(|&n| left[n] && outgoing[n] == 0).collect();
    while let Some(node) = ends.pop() {
        left[node] = false;
        for &from in &backwards[node] {
            outgoing[from] -= 1;
            if outgoing[from] == 0 {
                ends.push(from);
            }
        }
    }
    left
}

/// One loop among the nodes on loops: walk forwards until a node comes again.
fn loop_path(graph: &Graph, done: &[bool]) -> Vec<usize> {
    let on_loop = nodes_on_loops(graph, done);
    let Some(mut node) = on_loop.iter().position(|&l| l) else { return Vec::new() };
    let mut seen: HashMap<usize, usize> = HashMap::new();
    let mut path = Vec::new();
    loop {
        if let Some(&first) = seen.get(&node) {
            path.push(node);
            return path.split_off(first);
        }
        seen.insert(node, path.len());
        path.push(node);
        // A node that survived the peeling has a successor that did.
        match graph.edges[node].iter().find(|e| on_loop[e.to]) {
            Some(edge) => node = edge.to,
            None => return path,
        }
    }
}
