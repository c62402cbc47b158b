// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow words: what a sample's maps take of a point's light. Include it behind lib/marks.glsl; twin of native/device_cpu/kernels/shadow_words.h
#ifndef PT_SHADOW_WORDS_GLSL
#define PT_SHADOW_WORDS_GLSL

// a b / 255 of a, b up to 255, rounded: exact.
uint pt_shadow_share(uint a, uint b)
{
    uint product = a * b + 128u;
    return (product + (product >> 8)) >> 8;
}

// The word after what a map takes; whole: it is the sample's last. differ: whether the samples so far do.
uint pt_shadow_note(uint word, uint loss, bool whole, uint samples, out bool differ)
{
    uint sum = word & PT_SHADOW_SUM, lost = word >> PT_SHADOW_SHIFT;
    lost += pt_shadow_share(255u - lost, loss); // of the light that is left
    differ = whole && sum + lost != samples * lost;
    return whole ? sum + lost : sum | lost << PT_SHADOW_SHIFT;
}

// Where the word of a slot lies, behind the light's first.
uint pt_word_at(uint marked, uint step, uint slot) { return step * (marked != 0u ? pt_shown_place(slot) : slot); }

#endif
