"""List how people greet, thank and ask: one wording per line, as a regular expression that must match a whole clause.

A name in angle brackets stands for an entry of `PARTS`. Groups are not captured, but for `<THING>` (the noun phrase
that is asked about) and `<VALUE:...>` (what is asked about it). Clauses come in lower case, with their contractions
written out ("what is"). A backslash at the end of a line joins it with the next one.
"""

from __future__ import annotations

from collections.abc import Mapping

COLORS = (
    "red", "orange", "yellow", "green", "turquoise", "blue", "purple", "pink", "brown", "black", "white", "gray",
)  # fmt: skip
# Superlative -> the measure that it compares, and whether it means the most of it.
SUPERLATIVES: Mapping[str, tuple[str, bool]] = {
    "tallest": ("height", True), "highest": ("height", True), "shortest": ("height", False),
    "lowest": ("height", False), "flattest": ("height", False), "biggest": ("volume", True),
    "largest": ("volume", True), "smallest": ("volume", False), "widest": ("width", True), "longest": ("width", True),
    "narrowest": ("width", False), "thinnest": ("width", False), "nearest": ("distance", False),
    "closest": ("distance", False), "farthest": ("distance", True), "furthest": ("distance", True),
    "leftmost": ("left", True), "rightmost": ("left", False),
}  # fmt: skip
# Words that are in no noun phrase of an object: what holds one of them asks for something else.
NO_THING = frozenset(
    "to put make build place way ways chance possibility reason problem point room space idea difference time minute "
    "question questions doubt plan name opinion stack line arrange form create set lay move pile add swap take let "
    "give get do does did can could will would should may might must shall if that which who what when than because "
    "while you "
    "i me we us he she your my mine yours need use good better possible bit more less instead and or but not so too as "
    "like into next between behind beside under over about be been being go going nothing something anyone somebody "
    "anybody else again".split()
)
PARTS: Mapping[str, str] = {
    "ADDRESS": "(robot|mr robot|agent|structagent|arm|computer|mate|man|buddy|friend|partner|dear|you|there|everyone"
    "|all)",
    "THING": r"(?P<about>[\w'-]+( [\w'-]+){0,4}?)",
    "THE": r"((a|an|any|some|the|that|this|another|all|all the|your|also|still) )*",
    "OBJECTS": "(objects?|things?|items?|stuff)",
    "PLACED": "( (here|there|around|anywhere|left|at all|too|now|still|also|lying|standing|on (the|this|your) table"
    "|in front of you|in the scene|in view|you (can )?see|you have|altogether|in total|that there (is|are)))*",
    "SEE": "(see|have|got|have got|find|spot|recogni[sz]e|happen to see|happen to have|know|detect)",
    "SUPERLATIVE": f"<VALUE:{'|'.join(SUPERLATIVES)}>",
    "OF_ALL": "( (one|of (all|them|these|those|the lot|the bunch)|to you|from you|from here|to me|from me|away))*",
    "COLOR": f"({'|'.join(COLORS)})",
    "CHOOSE": "(choose|chose|chosen|pick|picked|prefer|preferred|select|selected|propose|proposed|suggest|suggested"
    "|take|took|want|decide|decided)( for| on)?",
    "THAT": "(that|this|it|the)( (one|arrangement|candidate|order|place|way|spot|position|choice|option|proposal|goal"
    "|best|first|second|third))*",
    "LATELY": "( (so far|just|just now|now|there|last|until now|here|today|before|(with|to) (it|them|that)))*",
    "SAY": "(do|say|type|write|enter|ask|tell you|ask you|ask for|ask you for|try|build|make|start with|use)",
    "BUILT": "(do|done|build|built|make|made|move|moved|change|changed)",
    "GREETING": "(hi|hiya|hello|hallo|hey|howdy|yo|greetings|good (morning|afternoon|evening|day))"
    "( (hi|hello|again|world|to you|<ADDRESS>))*",
    "THANKS": "(many )?(thanks|thank you|thankyou|thx|ty|cheers|ta|much appreciated)( (a lot|a million|again|so much"
    "|very much|for (that|this|it|everything|(the|your) help)|<ADDRESS>))*",
    "PRAISE": "((that|this|it) (is|was|looks) |you are |looks |how |i am )?((so|very|really|pretty|just|quite) )*(nice"
    "|great|good|lovely|cool|perfect|wonderful|awesome|excellent|beautiful|brilliant|amazing|fantastic|neat|impressive"
    "|impressed|super|wow)( (job|work|one|stuff))?|well done|i (like|love) (it|that|this)",
}

WORDINGS: Mapping[str, str] = {
    "greeting": r"""
        <GREETING>
        how (are|do) you( (do|doing|feeling))?
        (how is it going|how are things|what is up|sup)
        (nice|pleased|good) to (meet|see) you
        (are you|is (anybody|anyone|somebody)) (there|here|ready|awake)
        (anybody|anyone) (there|here)
        test|testing|ping
    """,
    "thanks": r"""
        <THANKS>
        <PRAISE>
    """,
    "identity": r"""
        (who|what) are you
        (what is your name|do you have a name)
        are you (a |an )?(real |actual )*(robot|ai|human|bot|person|machine|computer|llm|chat ?bot|language model\
            |real|alive)
        who (made|built|created|wrote|programmed) you
        what is (this|structagent|this program|this thing)
        what am i looking at
    """,
    "abilities": r"""
        what( (all|else|exactly))*( (sorts?|kinds?|types?) of)?( (<OBJECTS>|structures?|shapes?|arrangements?\
            |commands?))? (can|could) you( all)? (do|build|make|understand|form|arrange|help( me)? with)
        what( exactly)? are you( actually)? (able to (do|build|make)|capable of|good (at|for)|for)
        what you (can (do|build|make)|are able to do)
        what( else)? (can|could|should|do|may|must|shall|might) i <SAY>
        what (i|we) (can|could|should) <SAY>
        how (do|can|should|does|would)( i| one| we)? (start|begin|use (this|you|it)|talk to you|get started\
            |control you|work with (you|this|it))
        where (do|should|can) i (start|begin)
        (what|which) (shapes|structures|commands|arrangements|options|formations|patterns) (are (there|possible\
            |available)|do you (know|have|understand|support|offer)|can i (use|build|have|ask for))
        what are (my|the|your) (options|choices|possibilities|commands|abilities|capabilities|skills)
        i (do not|don't|dont) know what to (say|type|do|ask|write|build)
        i have no idea( what to \w+)?
        i (need|could use) (some )?help
        what is possible
        (now what|what now)
        what do you do
        (give|show) me (an |some )?examples?
        do you have (an |any )?examples?
        (commands|options|examples?|usage|menu)
        (how )?can you help( me)?
        what is there to do
    """,
    "working": r"""
        how does (this|that|it|all( of)? this|everything|the (robot|arm|program)|this thing\
            |structagent)( all)?( actually| really)? work
        how (this|it|that|all this|everything|you)( all)? works?
        how do you( actually| really)? (work|do (it|this|that)|see|choose|understand( me)?)
        how do you( actually| really)? (decide|know|choose)( what| where)?( (it|they|things|everything|the objects\
            |an object|each object|to) (goes?|go|stands?|put (it|them|things)))?
        explain how (it|this|you) works?
        explain (yourself|this)
    """,
    "objects": r"""
        (what|which)( all| else| kinds? of)*( <OBJECTS>)? ((do|can|could) you <SEE>|have you( got)?|(is|are)( there\
            | lying| standing)*|there (is|are)|lies|stands?|you (can )?<SEE>|can i use|i can use)<PLACED>
        what are( all)? (the|these|those|all the) <OBJECTS>( called)?<PLACED>
        what (is )?on (the|your|this) table( is)?
        what does (the|your) (table|scene) look like
        (list|name|describe|show( me)?)( (all|every|the|of|your|these|those|that))* (<OBJECTS>|everything|table\
            |scene|inventory)<PLACED>
        (list|describe|show me)( all)? what (is (there|here|on the table)|you (can )?see|there is)<PLACED>
        (do|can) you see (anything|something|the table|the objects)<PLACED>
        (have a )?look( at the table| around)?
        are there any <OBJECTS><PLACED>
        <OBJECTS>
    """,
    "next": r"""
        what (are|will|would|do) you( (going to|gonna|want to|plan to|intend to|about to))? (do|build|make|move\
            |propose|suggest|try)( (now|next|then|first|with (them|it|that)))*
        what is (the|your)( current)? (plan|proposal|suggestion|idea|intention|next step|goal)
        what (is|comes|happens) next
        what happens( (now|next|then))*( (if|when) i (say|type|press|answer) (yes|y|no|n))?
        what are you (doing|planning|up to|working on|waiting for)
        are you busy
        where (will|would|do|does|should) (the )?<THING> (go|stand|end up|be)
        where (are|is) (the )?<THING> going( to go)?
        (how|what) (will|would) (it|that|this) look( like)?
    """,
    "done": r"""
        what (did|have) you( (just|already|actually))* <BUILT><LATELY>
        what( just| has)? happened<LATELY>
        (did|does|has) (it|that|this|you) (work|worked|succeed|succeeded|finish|finished|manage|managed|fail|failed\
            |stand)( it| that)?
        (are you (done|finished)|have you (finished|done it))
        is (it|that|this) (done|finished|ready|built|standing)
        (what was that|what went wrong)
        why did (it|that|you|this) (fail|stop|not work)
        why didn't (it|that|this) work
        did (anything|something) go wrong
        how did (it|that) go
    """,
    "wish": r"""
        what (did|have) i( (just|actually))* (ask|asked|say|said|want|wanted|tell you|order)( you)?( for\
            | to do)?( again| last| before)*
        what (is|was) (my|the) (last |current |latest )?(wish|request|instruction|order)
        what do i want
        where (are we|were we|do we stand)
        (what is the )?(status|state)
    """,
    "why": r"""
        (why|how come)
        why <THAT>( (and )?not (the |an)?others?( one)?)?
        why (there|here)
        why not (the )?(an)?others?( one)?
        (why|how come|how)( did| do| have| would)? you <CHOOSE>( <THAT>)?
        why (did|have) you (do|done) (it|that|this)( (way|that way|like that))?
        why (is|was) <THAT> (the )?(best|better|first|chosen|your choice)
        why (is )?(candidate|number) <VALUE:\d+>( (the )?(best|better|first))?
        (explain|justify) (your|the|that|this) (choice|decision|proposal|reasoning|suggestion)
        what (is|was) (your|the) reason(ing)?( for (that|this|it))?
        what speaks for <THAT>
    """,
    "extreme": r"""
        (which|what|who|where)( one| <OBJECTS>)? (is|are) (the |your )?<SUPERLATIVE><OF_ALL><PLACED>
        (which|what|who|where)( one| <OBJECTS>)? (is|are) (the |your )?<SUPERLATIVE> <THING><OF_ALL><PLACED>
        which( one)?( of)?( (the|these|those))? <THING> (is|are) (the )?<SUPERLATIVE><OF_ALL><PLACED>
    """,
    "count": r"""
        how many( are)?<PLACED>
        how many( of)? <THE><THING>( (are|do|can|have|is)( (there|you|we|i|on the table|got\
            |here))*( <SEE>)?)?<PLACED>
        how many <THE><THING> there are<PLACED>
        what number of <THING> (are|do|have) (there|we|you)( (dealing with|have|got))*
        (how many have (you|we) got of|count|(what is )?the number of) <THE><THING><PLACED>
    """,
    "color": r"""
        (what|which) color (is|are|has|have|does|do|would you say) <THE><THING>( have| is| are)?
        what (is|are) the color of <THE><THING>
        (is|are) <THE><THING> <VALUE:<COLOR>( or <COLOR>)*>
    """,
    "size": r"""
        (how (tall|high|big|large|wide|long|small)|what size) (is|are) <THE><THING>
    """,
    "object": r"""
        what( kind of thing)? is <THE>(?P<about>(object|number|thing) \d+)
    """,
    "where": r"""
        where (is|are|was|were|do you see|can you see|stands?|lies?) <THE><THING>( (now|standing|lying|located|gone\
            |at|placed))*
        where (did|have) you (put|see|find|leave|left|found|seen) <THE><THING>
        where <THE><THING> (is|are|stands?|lies?)( (now|standing|lying))*
        (what is )?the (position|place|location) of <THE><THING>
        how far( away)? (is|are) <THE><THING>( away)?
    """,
    "there": r"""
        (is|are|was|were|isn't|aren't) there <THE><THING><PLACED>
        there (is|are) <THE><THING><PLACED>, (is|are)n't there
        there (isn't|aren't|is no|are no) <THE><THING><PLACED>, (is|are) there
        ((do|can) you <SEE>|don't you (see|have)|have you (got|seen|found)) <THE><THING><PLACED>
        (is|are) <THE><THING> ((still|also|even|really) )*(there|here|gone|missing|on the table|in view|visible)
        (got|any) <THE><THING><PLACED>\?
    """,
}
