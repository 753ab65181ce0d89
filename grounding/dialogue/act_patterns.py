"""List how people greet, thank and ask: one wording per line, as a regular expression that must match a whole clause.

A name in angle brackets stands for an entry of `PARTS`. Groups are not captured, but for `<THING>` (the noun phrase
that is asked about), `<VALUE:...>` (what is asked about it), and `<REL> <OTHER>` (a place by another noun phrase).
Clauses come in lower case, with their contractions written out ("what is"). A backslash at the end of a line joins it
with the next one.
"""

from __future__ import annotations

from collections.abc import Mapping

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
    "remaining": r"""
        (what|how much)( <OBJECTS>| work| parts?| else)? (is|are|remains?)( still)?( left| to do| missing| to be done\
            | to build\
            | to be built| not done| not built| not finished| open| remaining\
                | outstanding)+( (yet|now|still|to do|to build))*
        (what|how much) (remains|is left over)( to be done| to do)?
        what( else)? is left( over)?( now| then| still)?
        what (do|must|should) you still( have to| need to)? (do|build|make)
        what (do|have) you still( got)?( have)? to (do|build|make)
        (is|are)( there)? (anything|something|any parts?|parts?)( still)? (left|missing|to do|open\
            |remaining)( to (do|build|make\
            |be done|be built))?
        (is|was) (everything|all|it all|all of it) (done|finished|built|ready)
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
    "related": r"""
        (what|who|which)( all| else| kinds? of)*( <OBJECTS>| one| ones)? (<IS>|do you <SEE>|can you <SEE>|have you got\
            |there is)\
            ( there)? <REL> <THE><OTHER>
        (is|are|was|were)( there)? (anything|something|nothing|anybody|any <OBJECTS>|<OBJECTS>|one)( else)?\
            ( (there|standing|lying|sitting|placed))* <REL> <THE><OTHER>
        (do|can) you see (anything|something) <REL> <THE><OTHER>
        (anything|something|what|what is) <REL> <THE><OTHER>\?
        (which|what) <THING> <IS> <REL> <THE><OTHER>
        what does <THE><OTHER> (hold|contain|carry|have on it|have in it)
        (what|who) is <THE><OTHER> (standing|lying|sitting|resting) <VALUE:on>
        (what|which)( <OBJECTS>| one)? (is|are) <VALUE:nearest|closest|next>( to)? <THE><OTHER>
    """,
    "next": r"""
        what (are|will|would|do) you( (going to|gonna|want to|plan to|intend to|about to))? (do|build|make|move\
            |propose|suggest|try)( (now|next|then|first|with (them|it|that)))*
        what is (the|your)( current)? (plan|proposal|suggestion|idea|intention|next step)
        what (is|comes|happens) next
        what happens( (now|next|then))*( (if|when) i (say|type|press|answer) (yes|y|no|n))?
        what are you (doing|planning|up to|working on|waiting for)
        are you busy
        where (will|would|do|does|should) (the )?<THING> (go|stand|end up|be)
        where (are|is) (the )?<THING> going( to go)?
        (how|what) (will|would) (it|that|this) look( like)?
    """,
    "done": r"""
        what (did|have) you( (just|already|actually))* (do|done|move|moved|change|changed)<LATELY>
        what( just| has)? happened<LATELY>
        (did|does|has) (it|that|this|you) (work|worked|succeed|succeeded|finish|finished|manage|managed|fail|failed\
            |stand)( it| that)?
        (are you (done|finished)|have you (finished|done it))
        is (it|that|this) (done|finished|ready|built|standing)
        (what was that|what went wrong)
        what you( (just|already|actually|have))* (did|done|built|made|moved|changed)<LATELY>
        why did (it|that|you|this) (fail|stop|not work)
        why didn't (it|that|this) work
        did (anything|something) go wrong
        how did (it|that) go
    """,
    "built": r"""
        what (did|have) you( (just|already|actually))* (build|built|make|made)<LATELY>
        (what|which)( <OBJECTS>|( of the)? (parts|structures))? (is|are|was|were|have been|has been)( already)? (built\
            |made|done|finished)\
            <LATELY>
        what (stands|is standing)( already| now)*
    """,
    "wish": r"""
        what is (the|your|my|our)( current| present)? goal( now| again)?
        what are( all)? the parts( of (it|this|that|the goal))?
        (which|what) parts (are there|does (it|the goal) have|do we have|have we got|have you got)
        (list|show|name|tell)( me)?( (all|the))* parts( of (it|the goal))?
        (what|which) (is|was) part <VALUE:\d+>( again)?
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
        how (tall|high|big|large|wide|long|small|far( away)?) (is|are) (the \
            |your )?<SUPERLATIVE> <THING><OF_ALL><PLACED>
        how (tall|high|big|large|wide|long|small|far( away)?) (is|are) (the |your )?<SUPERLATIVE><OF_ALL><PLACED>
        which( one)? of <THE><THING> (is|are|stands?) (the )?<COMPARATIVE>( (to|from) (you|the arm|here))*
        which( <THE>)?<THING> (is|are|stands?) (the )?<COMPARATIVE>( (to|from) (you|the arm|here))*
    """,
    "compare": r"""
        (is|are) <THE><THING>( much| any| really)? <COMPARATIVE> than <THE><OTHER>
        (which|what)( one| of (them|these|those|the two))? (is|are) (the )?<COMPARATIVE>[, ]+(the \
            |a )?<THING>,? (?P<relation>or)\
            ( is( it)?)? (the |a )?<OTHER>
        (are|is) <THE><THING>( of| about)? <VALUE:as tall|as high|as big|as large|as wide|as long\
            |as small> as <THE><OTHER>
    """,
    "same": r"""
        (are|is|do|does) <THE><THING>( all| both| have)*( of)? <THE><VALUE:same size|same height|same width|same color\
            |equally tall|equally big|equally large|equally high|different sizes?|different colors?|different heights?>
    """,
    "distance": r"""
        how far( (apart|away))? (is|are) <THE><THING>( away)? (from|to) <THE><OTHER>
        how far( away)? (from|to) <THE><OTHER> (is|are) <THE><THING>
        how far( apart)? (is|are) <THE><THING> and <THE><OTHER>( (from )?each other)?( apart)?
        (what is )?the (distance|gap|space) (between|from) <THE><THING> (and|to) <THE><OTHER>
        how (big|wide|large|much) is the (gap|distance|space) between <THE><THING> and <THE><OTHER>
        how much (space|room|distance) is( there)? between <THE><THING> and <THE><OTHER>
        how close (is|are) <THE><THING> to <THE><OTHER>
    """,
    "reach": r"""
        (can|could) (you|the arm|the robot)( (actually|even|really|possibly))* (reach|get at|get hold of|get to|grasp\
            |grab|pick up|lift\
            |hold|take hold of) <THE><THING>
        (can|could) you pick <THE><THING> up
        (is|are) <THE><THING> (in|within|out of|out) (reach|range)( for you| of the arm)?
        (is|are) <THE><THING> (reachable|graspable|too far( away)?( for you)?\
            |too (big|large|heavy) for (you|the arm|the hand))
    """,
    "empty": r"""
        (is|are) <THE><OTHER>( still| really)? <VALUE:empty|free|clear|full|occupied|covered>
    """,
    "count": r"""
        how many( are)?<PLACED>
        how many( of)? <THE><THING>( (are|do|can|have|is)( (there|you|we|i|on the table|got\
            |here))*( <SEE>)?)?<PLACED>
        how many <THE><THING> there are<PLACED>
        how many <THE><THING> (are|is|stands?|lies?|sits?|do you see|can you see|have you got\
            |do you have)( there)? <REL> <THE><OTHER>
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
        where <THE><THING> (is|are|stands?|lies?|went)( (now|standing|lying))*
        where (did|has|have) <THE><THING> (go|gone|end up|got to|get to)( to)?
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
        ((is|are) there|do you <SEE>|can you see|is) (anything|something) (?P<about><COLOR>)<PLACED>
        (anything|something) (?P<about><COLOR>)<PLACED>\?
        does <THE><THING> exist
    """,
    "holds": r"""
        (is|are|was|were) <THE><THING>( (still|already|really|now|also|standing|lying|sitting))* <REL> <THE><OTHER>
        (does|do) <THE><THING> (stand|lie|sit) <REL> <THE><OTHER>
    """,
}
