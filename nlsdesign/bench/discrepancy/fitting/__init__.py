"""How the numbers of one hypothesis are fitted: from which starts, with which loss, within which limits.

``effects`` and the rooms above may import it: an effect brings the strategy that suits it; it builds on
``blocks``. It never compares hypotheses.
"""
