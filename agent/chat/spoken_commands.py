"""Define the wordings for slash commands: one per line, as a regular expression that must match the whole line after
`grounding.dialogue.acts.bare`. A backslash at the end of a line joins it with the next one.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

_THAT = "(that|it|this|them|these|those|everything|all|all of it|the whole thing)"
_THE_LAST = (
    "((the|my|your|that) )?(very )?(last|previous|latest)( "
    "(one|thing|step|change|move|turn|action|bit|build|command|line"
    "|instruction|request|edit|correction))?( (i|you) (said|did|made|built|asked( for)?))?"
)
_BACK_TO = "(the )?(start|beginning|very beginning|initial state|original state|square one)"
_AGAIN_START = "(start|begin)( (it|this|that|everything|all))?( all)? (over|again|anew|afresh|fresh|new)( again)?"
WORDINGS: Mapping[str, str] = {
    "/undo": rf"""
        undo( ({_THAT}|{_THE_LAST}|once|one|one step|a step|again|your last step))?
        (take|turn|roll) {_THAT} back|(take|roll) back( ({_THAT}|{_THE_LAST}))?
        revert( ({_THAT}|{_THE_LAST}))?
        (go|step|move|one|a) (back )?(by )?(one|a|1) (step|turn|move)( back)?
        (one|a) (step|turn) back|step back|go back|back up( (one|a) step)?
        (that was (wrong|a mistake|an accident|not what i wanted) )?undo
    """,
    "/redo": rf"""
        redo( ({_THAT}|{_THE_LAST}))?
        undo (the|that|your) undo
        (go|one|a) (one|a)? ?(step )?forward
    """,
    "/again": r"""
        (try|do|propose|suggest)( (it|that|this|them))?( once| one time)? (again|more|anew)
        again|once( more| again)|one more time|another time|another try|retry|(give|have) it another (try|go|shot)
        (show|give|propose|suggest|try|make)( me)? (another|a (different|new|second|fresh))( (one|arrangement\
            |proposal|suggestion|way|option|idea))?
        (show|give|propose|suggest|try)( me)? (some )?(other|others|different|new|more)( (ones?|arrangements?\
            |proposals?|suggestions?|options?|ideas?))?
        ((how|what) about |let me see |can (we|i) see )?(another|(another|a (different|new|second|fresh)) (one\
            |arrangement|proposal|suggestion|way|option|idea))
        ((show|give|propose|suggest|try)( me)? |(how|what) about )?something (else|different|new)
        (different|new|other|more) (ones?|arrangements?|proposals?|suggestions?|options?|ideas?)
        (show( me)? |give me |try )?(the )?next( (one|arrangement|proposal|suggestion|way|option|idea))?
        (what|anything) else|not (this|that) one|any other ideas?
    """,
    "/help": r"""
        help( me)?( out)?|\?|i need help|show( me)?( the)? help|show( me)?( all)?( the)? commands
    """,
    "/quit": r"""
        quit|exit|bye( bye| now)?|good ?bye|see you( later| soon)?|(quit|exit|end|close|leave)( the| this) (chat\
            |program|session|conversation|game)
        that is all|that was all|that is it for (now|today)|i am (done|finished)
    """,
    "/stop": r"""
        (stop|halt|abort|cancel|freeze)( (it|that|this|stop|halt|now|here|there|right|right there|right away\
            |immediately|at once|the (build|building|arm|robot|proposal|plan|question)|what you are doing|moving\
            |building))*
        (do not|don't) (move|do (it|that|this|anything)|build( (it|that|this))?|go on)( any ?more| now)?
        hold (on|it)|leave it( (be|alone|at that))?|leave it as it is
    """,
    "/wait": r"""
        wait( (here|there|now|up|for me|for it|(for )?(a|one) (bit|moment|minute|second|sec)))*
        pause( (it|that|here|there|now))*|one (moment|minute|second|sec)|hang on( a (bit|moment|minute|second|sec))?
    """,
    "/clear": rf"""
        clear( ({_THAT}|(the|my|your) (goal|goals|request|instruction|plan|task|list)|all( the)? (goals|parts)))?
        (forget|scrap|discard|dismiss|cancel|abandon)( about)? (it|everything|all|all of (it|that)\
            |it all|the whole thing|the (goal|plan|request|task)|my (goal|request|instruction)s?)( (i|we\
            |that i) (have )?(said|asked( for)?|told you|wanted|want))?
        (forget|scrap|drop) what i (said|asked( for)?|told you|wanted)( so far| before)?
        (drop|delete|remove) (the|all|all the) (goal|goals|plan|parts|request)
    """,
    "/continue": r"""
        continue( (with (it|that|this)|building|please|then|now|the (build|building|work)))*
        (go|carry|move) on( (with (it|that|this)|building|then|now))*|keep (going|building|on)|carry on building
        proceed( (with (it|that|this)|then|now))*|resume( (it|that|building|the build|work))?
        (finish|complete) (it|that|this|the (job|build|building|work|rest)|what you (started|began))|go ahead and finish
        pick up where (you|we) (left off|stopped)
    """,
    "/reset": rf"""
        reset( (it|that|this|everything|all|all of it|the (table|scene|whole thing|whole table|lot)))?
        {_AGAIN_START}|(start|begin)( (it|this|everything|all( over)?))?( again)? from( the)? (scratch|start\
            |beginning|very beginning|top|zero)
        restart( (it|this|everything|from scratch))?|(back|go back|return|take (it|us|me) back) to {_BACK_TO}\
            |from scratch|from the (top|beginning)
        (put|bring|set|restore) everything( back)? (to {_BACK_TO}|as (it was )?(at|in) {_BACK_TO}|to how it (was\
            |began|started))
    """,
    "/back": r"""
        (put|move) (it|that|this|them|these|things|the things|the objects|all the objects|everything|it all\
            |all of it|them all|all of them|all|everything on the table) back
    """,
}


def _joined(lines: str) -> list[str]:
    """Return the wordings, with lines joined at a trailing backslash."""
    return re.sub(r"\\\n\s*", "", lines).splitlines()


SPOKEN = tuple(
    (name, re.compile("|".join(f"(?:{line.strip()})" for line in _joined(lines) if line.strip())))
    for name, lines in WORDINGS.items()
)


def spoken_command(said: str) -> str | None:
    """Return the command, with its slash, that a bare line expresses; `None` if it says anything else as well."""
    return next((name for name, wording in SPOKEN if wording.fullmatch(said)), None)
