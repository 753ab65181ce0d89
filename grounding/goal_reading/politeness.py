"""Recognise politeness, thanks and the small talk around a request: phrases that ask for nothing themselves."""

from __future__ import annotations

import re

from grounding.goal_reading.tokens import Words

_VERY = r"(?:(?:so|very|really|just|much|a lot|far|even|way|rather|quite) )*"
_PLEASANT = (
    r"(?:great|nice|nicer|lovely|lovelier|cool|wonderful|fantastic|awesome|amazing|perfect|ideal|super|kind|good|better|best|swell|sweet|pretty"
    r"|prettier|fun|funny|neat|neater|tidier|handy|handier|helpful|useful|practical|convenient|sensible|fine|safer|easier|beautiful)"
)
_PHRASES = tuple(
    re.compile(pattern)
    for pattern in (
        r"(?:would|could|will|can) you (?:please )?be (?:so |very |ever so )?(?:kind|good|nice|sweet|gracious|an? \w+)(?: enough)?(?: as)? (?:to|and)",
        r"be (?:so |very )?(?:kind|good|nice|sweet|an? (?:dear|darling|sweetheart|angel|love|sport|good \w+)|helpful)(?: enough)?(?: as)? (?:to|and)",
        r"do (?:me|us) (?:a|the|one|this) (?:\w+ )?(?:favor|favour|kindness|honor|honour|service)(?: (?:and|of|by))?",
        r"i(?: would|'d| will|'ll|'m| am)?(?: really| truly| very much| just| ever so| so| be| so very| most| much)*"
        r" (?:appreciate|grateful|glad|happy|obliged|thankful|delighted|thrilled)(?: it)?(?: very much| a lot)?(?: if| to see| to have)?(?: you (?:could|would|can|might))?",
        r"i (?:was|am|'m) (?:just |kind of |sort of )?(?:hoping|wondering|thinking)(?: that| if| whether| maybe)*(?: (?:you|we) (?:could|can|might|would))?",
        rf"(?:would|wouldn't) (?:it|that) (?:not )?(?:be|look|feel) {_VERY}{_PLEASANT}(?: of you)?(?: if| to have| to see| to)?(?: (?:you|we) (?:could|would|can))?",
        rf"(?:it|that|things|the table)(?:'d| would| might| could) (?:be|look|feel|seem) {_VERY}{_PLEASANT}(?: of you)? (?:if|to have|to see)",
        rf"(?:would|might|could) (?:be|look|feel|seem) {_VERY}{_PLEASANT}(?: to [a-z]+)? if",
        rf"how {_PLEASANT} (?:it )?would (?:it )?be(?: if| to have| to see)",
        r"(?:if|when|whenever|once|as soon as) (?:you|you've|there's|there is)(?: (?:get|got|have|find|manage to find|can find|can spare|could spare|happen to have))*"
        r" (?:(?:a|an|some|the|any|enough) )?(?:(?:spare|free|quiet|little|bit of|calm) )*(?:minute|moment|second|sec|time|chance|opportunity|break)(?: to spare| for (?:me|this|it|that))?",
        r"in the meantime|meanwhile|in the meanwhile|for the moment",
        r"(?:it would|it'd|that would|that'd) (?:be (?:so |very |really |just )?(?:great|nice|lovely|cool|wonderful|fantastic|awesome|amazing|perfect|ideal|super|kind|good|swell|sweet)(?: of you)?"
        r"|make (?:my|our) (?:day|week|life)(?: easier)?|make me (?:so |very |really )?happy|help(?: me| us)?(?: a lot| a great deal| so much| greatly)?|mean (?:a lot|the world|so much)(?: to me)?)"
        r"(?: if| to have| to)?(?: (?:you|we) (?:could|would|can))?",
        r"(?:to be (?:honest|fair|frank|precise about it)|honestly|frankly|by the way|as you know|as you can see|you see|you know what|guess what|if you ask me|for what it's worth"
        r"|just so you know|fyi|btw|as far as i'm concerned|in my opinion|imo|imho|i(?:'d)? (?:guess|suppose|reckon|believe|imagine|daresay|bet|say|figure)|or so i think|you might say"
        r"|let me (?:think|see)(?: about (?:it|that|this))?|let's see|now let's see|what the heck|oh well|never fear|with all due respect|with respect|no offense|no offence"
        r"|while you(?:'re| are) at it|while we(?:'re| are) at it|when all is said and done|all in all|in short|long story short|in other words|for a change|for once|for good measure|for fun"
        r"|for the time being|for example|at your (?:leisure|convenience|earliest convenience)|any ?time|no hurry|no pressure|whenever you like|don't worry(?: about it| if it takes (?:a while|some time|long|time|a bit|ages))?|not to worry|no worries"
        r"|my goodness|my word|my god|oh my god|oh my|good lord|good grief|good heavens|for (?:god's|heaven's|goodness|goodness'|pete's) sake|i beg you|i'm begging you|pretty please"
        r"|if i may(?: say so)?|if (?:i )?(?:may|might)|as i said|like i said|i(?:'d| would) (?:rather|sooner|much rather) (?:have|like|see)|rather have|kindly to|here we go|there we go|here goes|chop chop"
        r"|your mission(?: today)? is(?: simple)?|your task(?: today)?(?: is)?|so here's the (?:thing|deal|plan)|here's the (?:thing|deal|plan)|the plan is(?: this)?|this is what i(?:'d)? (?:want|need|like)|happy \w+|merry christmas)",
        r"(?:good (?:day|afternoon|morning|evening|night|job|work)|well done|bravo|goodbye|bye(?: bye)?|see you(?: later| soon)?|have a (?:nice|good|great|lovely) (?:day|one|time|weekend)|love you|god bless(?: you)?|bless you)",
        r"(?:therefore|hence|thus|consequently)",
        r"(?:much obliged|all the best|best regards|kind regards|regards|yours truly|ta very much|that will be all|that would be all|over and out)",
    )
)  # fmt: skip
# What opens a request, and asks for nothing by itself.
_OPENERS = tuple(
    re.compile(pattern)
    for pattern in (
        r"(?:please )?(?:feel free|do not forget|don't forget|dont forget|remember|be sure|make certain|take care|try|attempt|manage|get ready"
        r"|proceed|time|it's time|it is time|you need|you'll need|you will need|you have|you'll have|you will have|you've got|you're going|you are going"
        r"|i need you|i expect you|i ask you|i urge you|i dare you|i challenge you|i'm asking you|i'd love you|i'd love for you|i'd like for you"
        r"|i'm going to need you|i'm gonna need you|i will need you|i'll need you|the (?:goal|idea|plan|task|job|aim|point|trick) (?:here |now |today )?is"
        r"|what you (?:have|need) to do is|all you have to do is|all you need to do is|what (?:i'd|i would) like you to do is|i'm trying|we're trying"
        r"|you're supposed|you are supposed|may i ask you|can i ask you|could i ask you|might i ask you) to(?= [a-z])",
        r"(?:start|begin|finish|end|kick|carry)(?: off| on| up)? by(?= [a-z]+ing)",
        r"(?:why don't (?:you|we)|why not|what if (?:you|we)|how about (?:you|we)|how about|what about)(?= [a-z])",
        r"(?:is there )?(?:any|a) (?:chance|way|possibility) (?:that )?(?:you|we) (?:could|can|might|would|get to)(?: possibly)?",
        r"(?:see|check|find out) (?:if|whether) you can|see to it that|show me how you(?:'d| would| can| could)?|show me that you can|let me see you"
        r"|prove (?:to me )?that you can|i (?:bet|know|think|believe|guess|assume|hope|trust) (?:that )?you (?:can't|cannot|can|could|will)",
        r"(?:come|go) on(?= ,| !| \.)",
        r"(?:all|what|the only thing|the thing) (?:that )?(?:i|we)(?:'d| would| really| just| actually)* (?:want|need|like|ask|request|ask for|am after)(?: now| here| today)? (?:is|are)(?: for you)?(?: to(?= [a-z]))?",
        r"(?:what (?:i'm|we're) after|my (?:wish|request|order|idea|plan|instruction|instructions)(?: for you)?) (?:is|are)(?: this| as follows| for you)?(?: to(?= [a-z])| that)?",
        r"(?:i'd|i would|i|we'd|we would) (?:love|like|appreciate|prefer|welcome|dig) it if (?:you|we) (?:could|would|can|might)?",
        r"(?:i'd|i would) be (?:over the moon|so happy|very happy|in your debt|eternally grateful|obliged|much obliged)(?: if (?:you|we)(?: could| would| can)?)?",
        r"(?:do you )?(?:think|reckon|suppose) (?:that )?you (?:could|can|might)(?: possibly| maybe)?(?: manage to)?",
        r"(?:can|could|may|might) (?:i|we) (?:please |perhaps )?(?:have|get|see)|shall we",
        r"if (?:you'd|you would|you could|you will) be (?:so |very )?(?:kind|good|nice)(?: as to| enough)?",
        r"if there(?:'s| is) (?:still )?(?:any |enough |some )?(?:room|space|time)(?: (?:left|for it|for them))?|(?:space|time) permitting|if (?:it|they|that) fits?|if (?:need be|necessary|needed|required)",
        r"(?:wherever|however|whichever(?: way)?|whatever way|any way|anywhere|in any way|in whatever way) (?:you|we) (?:like|want|prefer|please|wish|fancy|see fit|choose)",
        r"(?:,? ?(?:and|but) )?(?:it )?(?:(?:doesn't|does not|don't) (?:really )?matter|i (?:don't|do not) (?:really )?(?:care|mind)|no matter)(?: (?:where|which|how)(?: (?:side|one|way|is which|exactly|it is|they are|they go|it goes|goes where))*)?(?= [.,;!?]|$)",
        r"(?:is|are) (?:what|where) (?:i|we)(?:'d| would| really)* (?:like|want|need|prefer|love|wish|ask)(?: (?:to (?:have|see|put|place|go)|for))?(?= )",
        r"(?:and |so )*for (?:that|this|it)(?= (?:i|we|i'd|i'll|you|please|could|can|we'd)\b)",
        r"(?:and |so |now )*here (?:it comes|it is|goes|we go|they are|comes the (?:task|job|instruction))(?= [:,.!]|$)",
        r"(?:will|would) (?:do|suffice)(?: (?:fine|nicely|just fine|for me))?(?= [.,;!?]|$)|(?:is|are|would be) (?:fine|good enough|ok|okay)(?: (?:by|with|for) me)?(?= [.,;!?]|$)",
        r"(?:that|it|this)(?:'d| would|'ll| will) be (?:so |really |very |just |absolutely )?[a-z]+(?= [.,;!?]|$)",
        r"(?:with|leaving|keeping|at) (?:exactly )?(?:the same|equal|even|identical|regular|constant|equally big|equally large) (?:amounts? of )?(?:space|spaces|spacing|gap|gaps|distance|distances|interval|intervals)"
        r"(?: (?:between|in between) (?:them|each|each of them|each other|one another|all of them|neighbou?rs|any two|one and the next))?",
        r"(?:i think |i guess |maybe )?(?:it|things|that|the table)(?:'d| would| might| will) (?:look|be|feel|seem|work) (?:so |much |a lot |far |even |way )*[a-z]+(?: to me| for me)? (?:if|to have|with)(?= )",
        r"(?:if|provided) (?:that|this|it|you know what i)(?: makes?| made| mean)(?: any| some)?(?: sense)?|if you (?:see|know|get) what i mean|if you (?:follow|understand)(?: me)?",
        r"(?:is|are|was|were|it's|they're)? ?(?:meant|supposed|intended|destined|expected|required|bound|going|about|due|ought) to(?= (?:be|go|stand|sit|lie|form|end|stay|come|make|rest|get|become|build)\b)",
        r"(?:because |and )?i won't (?:say|ask|tell you|repeat) (?:it|this|that|you)?(?: twice| again)|don't make me (?:say|ask|repeat) (?:it|this|that)(?: twice| again)?|think twice"
        r"|,? ?you know which(?: one)?|,? ?you know the one",
        r"what (?:i'd|i would|i) (?:like|want|need) (?:you )?(?:to (?:do|happen|see) )?is(?= )|(?:i|we) (?:told|asked|ordered|said|meant|wanted)(?: (?:you|it|robot))?(?: (?:to|for|that|already|before))*(?= (?:put|place|move|have|stack|line|make|set|lay|get))",
        r"(?:you|u) (?:forgot|failed|neglected|didn't manage) to|once more|one more time|(?:do )?you see (?=the|that|this|my)|take a look at(?= )|look at(?= the| that| this)|do(?= (?:put|place|move|stack|line|make|have|set|lay|get)\b)",
        r"(?:it's|it is|it'd be|it would be|would be|might be) (?:better|best|nicer|nice|good|great|safer|easier|wise|wiser)(?: (?:if|for|to have|to put|when))?(?= )|let's say(?: that)?|suppose(?: that)?|imagine(?: that)?(?= the)|i (?:suggest|recommend|propose|advise)(?: that)?(?: you(?: should)?)?|i'd (?:suggest|recommend|propose|advise)(?: that)?(?: you)?",
        r"if it(?:'s| is| isn't| is not) (?:all the same to you|no bother|no trouble|not too much (?:trouble|to ask|bother|hassle)|too much (?:trouble|to ask|bother|hassle))",
        r"sorry (?:to (?:bother|trouble|interrupt|disturb|pester) you|for (?:bothering|troubling|interrupting|disturbing) you|to ask)(?: again| once more| with this| so late| but)*",
        r"(?:no|not a) (?:idea|clue) why(?: ,)?(?: but)?|don't ask(?: me)? why(?: ,)?(?: but)?|i don't know why(?: ,)?(?: but)?|first things first|(?:let's|let us) get started|here's what (?:i|we)(?:'d)? (?:want|need|like)",
        r"(?:according to|as per|as stated in|following|per) (?:the|my|our|this|that) (?:manual|plan|instructions|drawing|sketch|picture|recipe|book|list|rules|tradition|boss|schedule|blueprint|diagram|spec|specs)",
        r"would it be (?:too much (?:trouble|to ask|bother)|ok|okay|all right|possible|a problem|feasible)(?: for you)?(?: to(?= [a-z])| if you(?: could)?)?",
    )
)
# How the arm should work; what is built stays the same.
_MANNERS = tuple(
    re.compile(pattern)
    for pattern in (
        r"nice and (?:slow|slowly|easy|gentle|gently|steady|careful|carefully|quick|quickly|soft)|slow and steady|slow and easy",
        r"with (?:a (?:lot|bit) of |great |the utmost |utmost |extra |much |due |some |all |maximum )?(?:care|caution|precision|delicacy|patience|feeling)",
        r"(?:as )?(?:gently|carefully|quickly|slowly|fast|quick|softly|neatly|quietly|precisely|exactly|accurately|best|well|smoothly|swiftly) as (?:you can|possible|you could|you are able(?: to)?|you're able(?: to)?|you like)",
        r"without (?:any |further )?(?:hurry|haste|delay|rush|fuss|hesitation|ado|stopping|wasting time|rushing|making (?:a |any )?(?:noise|mess|sound|fuss))",
        r"(?:pronto|on the double|this instant|at full speed|in no time|real quick|super fast|super quick|double quick|quick as you like|slow|quick|fast|asap)(?= [.,;!?]|$| please)",
        r"(?:with|using) (?:your|the) (?:gripper|arm|hand|hands|robot arm|claw|fingers)",
        r"in (?:a|one) (?:gentle|smooth|careful|slow|quick|single|swift) (?:way|manner|motion|movement|move|go)",
        r"(?:take|taking) (?:all the|as much) time (?:you need|as you (?:need|like|want))|in your own time|one (?:at a time|by one|after the other)",
    )
)# What is to be done when the work is finished: the program reports in any case.
_REPORTING = re.compile(
    r"(?:and |then |, )*(?:you(?:'re| are) (?:all )?(?:done|finished|free to go)"
    r"|(?:tell|call|inform|notify|alert|ping|message|text) me (?:when|once|as soon as|after) (?:you(?:'re| are|'ve)|it(?:'s| is)|that(?:'s| is)|everything(?:'s| is)) (?:all )?(?:done|finished|ready|in place|complete)"
    r"|let me know (?:when|once|as soon as|if) (?:you(?:'re| are)|it(?:'s| is)|that(?:'s| is)|everything(?:'s| is)|there(?:'s| is| are)) (?:all )?(?:done|finished|ready|in place|complete|any problems?|a problem|any trouble)"
    r"|report back(?: to me)?(?: when (?:you're|it's) (?:done|finished))?|tell me if (?:it|that) (?:works|worked|is a problem))"
)

THANKS = re.compile(
    r"(?:many |much |a thousand |huge )?(?:thanks|thank you|thx|thank u|ty|merci|gracias|danke|grazie|cheers)(?: a (?:lot|bunch|million|ton|heap))?"
)
TAG = re.compile(
    r"(?:would|will|could|can|won't|shall|can't|couldn't) (?:you|we)(?: please)?|(?:ok|okay|right|yeah|yes|eh|huh|alright|deal|got it|got that|understood|you know|if you please)"
)


def polite_end(said: Words, place: int) -> int | None:
    """Return the place after the longest polite phrase that begins at a word; `None` where none does."""
    patterns = (*_PHRASES, *_OPENERS, *_MANNERS, _REPORTING)
    ends = [match[1] for pattern in patterns if (match := said.match(pattern, place)) is not None]
    return max(ends, default=None)
