/* The pulse width of OC2 in steps. */
#include "mark.h"

int main(void) {
    DDRD = 1 << 7;
    OCR2 = 63;
    TCCR2 = 1 << WGM20 | 1 << WGM21 | 2 | 1 << COM21;
    MARK(1);
    OCR2 = 255;
    MARK(2);
    TCCR2 = 1 << WGM20 | 1 << WGM21 | 2 | 1 << COM21 | 1 << COM20;
    OCR2 = 0;
    MARK(3);
    TCCR2 = 0;
    MARK(4);
    end();
}
