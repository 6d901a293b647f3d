//! Every code a message can carry: one line here, one page under `docs/diagnostics/`, at least one
//! fixture under `tests/diagnostics/`. A test holds the three against each other.

/// The code of a message, such as `U104`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Code(pub &'static str);

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

/// What the list knows of a code.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    pub code: Code,
    pub title: &'static str,
    /// The page that `lamella explain` prints.
    pub page: &'static str,
}

macro_rules! codes {
    ($($name:ident $title:literal),* $(,)?) => {
        $(#[doc = $title] pub const $name: Code = Code(stringify!($name));)*

        /// All codes, in the order of their families.
        pub const ALL: &[Entry] = &[
            $(Entry {
                code: $name,
                title: $title,
                page: include_str!(concat!("../../docs/diagnostics/", stringify!($name), ".md")),
            }),*
        ];
    };
}

// Families: S syntax, D names and definitions, U units and dimensions, M the model as a whole,
// W sweeps, T tables of numbers, N numerical limits, L left out, F files and settings, R the run.
codes! {
    S001 "the text does not fit the grammar here",
    S002 "a line begins with a word that begins no statement",
    S004 "a bracket has no partner",
    S005 "a text is never closed",
    S006 "a character has no meaning here",
    S007 "the edition line is missing, late or repeated",
    S008 "the edition is not known",
    S009 "something is nested too deeply",
    S010 "the file, a statement or a word is too large",
    S011 "a clause stands twice",
    S012 "comparisons do not chain",
    S013 "a number is not written in full",
    S014 "a unit is not written as one",
    S015 "there are more messages than are shown",
    F101 "a file cannot be read",
    F102 "a file is not UTF-8 text",
    F103 "a file or folder cannot be written",
    F104 "there is no such message code",
    F105 "a file of the scene cannot be read",
    F106 "a file lies outside of the folder of its scene",
    F120 "it is not clear which sweep is meant",
    F121 "a folder holds no sweep",
    F122 "there is no such point",
    F123 "a result is not the same again",
    F124 "what will run again, and why",
    F125 "a folder holds results of another kind",
    F126 "a folder holds another sweep",
    F127 "a sweep has no point",
    F128 "a scene has nothing to turn under this name",
    R101 "the run was interrupted",
    R102 "a value of the run is no longer right",
    R103 "the machine cannot give what the run needs",
    R104 "the plan contradicts itself",
    R105 "a result cannot be compared or measured",
    R106 "a step needs more sub-steps than it may take",
    R107 "reactions cannot be taken over a step",
    R108 "the flow has no solution",
    P001 "the command line sets a parameter that the scene does not have",
    P002 "a parameter lies outside of its range",
    D001 "two parameters of a function have one name",
    D002 "a name is defined twice",
    D003 "a name of the language is taken for something else",
    D004 "a name is not defined",
    D005 "a name cannot be used here",
    D006 "a definition needs itself",
    D007 "wrong arguments",
    D008 "an expression is too large",
    D009 "a value of the wrong shape",
    D010 "a name is never used",
    W001 "a sweep asks for what there is not",
    W002 "an axis or a value of a sweep stands twice",
    W003 "zipped axes of different length",
    W004 "a used scene uses another",
    W005 "it is not said which used scene is meant",
    W006 "a file is used twice",
    W007 "a sweep has too many points",
    U101 "values of different dimensions are combined",
    U102 "a function needs a plain number",
    U103 "a plain number is needed",
    U104 "a value has the wrong dimension",
    U105 "not a unit",
    U106 "a number is out of the range of numbers",
    U107 "a unit that is also a name",
    U108 "a value of the wrong kind",
    M001 "something is missing",
    M002 "something is given twice",
    M004 "a word is not known here",
    M005 "a value is out of range",
    M006 "the domain has the wrong number of axes",
    M007 "a periodic side without its partner",
    M008 "not a dispersion tensor",
    M009 "a reaction mixes amounts and masses",
    M010 "an instant reaction of one species",
    M011 "a rate does not fit its reaction",
    M012 "instant reactions compete",
    M013 "fractions of zones do not add up",
    M014 "a reference is compared with nothing",
    M015 "a measure asks for a result that no output gives",
    M016 "a reference does not fit",
    M017 "a measure could mean more than one output",
    M018 "the scene has no output",
    M019 "a species reacts at once and otherwise, too",
    M020 "an immobile species where nothing can stay",
    M021 "the charges of a reaction do not balance",
    M022 "reactions in equilibrium that fit no solution",
    M023 "an output that has no meaning in equilibrium",
    M024 "a model of activities that lacks what it needs",
    M025 "mass particles cannot do this yet",
    M026 "fluid particles cannot do this",
    M027 "parts of a side that do not fit",
    M028 "a place outside of the domain",
    M029 "a flow that makes or loses water",
    M030 "a Darcy flow without a solution",
    M031 "a source that cannot be",
    M032 "an output that these particles do not have",
    M033 "a flow cannot be read from its files",
    M034 "a table of a flow that has no cells",
    M035 "a flow that changes all the time",
    M036 "parcels cannot exchange in this scene",
    M037 "a profile that is no kernel",
    M038 "a reaction that pairs cannot do",
    T101 "a table of numbers cannot be read",
    T102 "the rows of a table make no function",
    T103 "a table is asked beyond its rows",
    T104 "a table may be asked beyond its rows",
    T105 "the rows of a table are no source",
    N101 "means over few particles are mostly noise",
    N102 "the step is coarse for a mixing zone",
    N103 "the bins add dispersion",
    N104 "a step carries particles across the whole domain",
    N105 "the domain runs empty at a side",
    N106 "the step is coarse for exchange and reaction in turns",
    N107 "the noise of bin means keeps reactants apart",
    N108 "the flow changes much within a period",
    N109 "the bandwidth is small for the distance of the parcels",
    N110 "a kernel reaches across the whole domain",
    N111 "a side and the water do not agree",
    N112 "water of packages that goes through no side",
    N113 "a random field that is finer than its cells",
    N201 "bins without particles",
    N202 "a step cannot resolve a mixing zone",
    N203 "the bins disperse more than the scene",
    N204 "an output of masses between two steps",
    N205 "a flow from files makes or loses water",
    N206 "a step exchanges too much",
    N207 "a bandwidth that reaches nobody or too many",
    N208 "a step in which pairs react too much",
    N301 "the run does not fit into memory",
    L010 "what a scene does not need is left out",
}

/// The entry of a code as a user types it (`u104` and `U104` are the same).
pub fn find(text: &str) -> Option<&'static Entry> {
    ALL.iter().find(|entry| entry.code.0.eq_ignore_ascii_case(text))
}
